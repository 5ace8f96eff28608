"""What the tests of replay buffers share: environments, a reward, and recording."""

import gymnasium
import numpy as np

STEPS = 50


def single():
    return gymnasium.make("fetch_env/FetchPush-v4")


def vector():
    return gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=2)


def flat(achieved_goal, desired_goal, info):
    """Judge x and y alone."""
    assert len(info) == len(achieved_goal)
    return -np.linalg.norm((achieved_goal - desired_goal)[..., :2], axis=-1)


def fill(envs, buffer, actions, steps=STEPS + 1):
    """Record an episode of each environment."""
    envs.reset(seed=0)
    buffer.record(envs)
    for step in range(steps):
        envs.step(actions[step : step + envs.num_envs])
        buffer.record(envs)
    return buffer
