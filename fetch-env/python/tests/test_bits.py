"""The same bits as gymnasium-robotics, on the reference's model."""

import fetch_env
import gymnasium
import numpy as np
import pytest
from reference import assert_same_info, assert_same_observation, bits


def pair(reference, env_id):
    """Make an environment and the real one."""
    ours = gymnasium.make(f"fetch_env/{env_id}", model="reference")
    return ours, reference(env_id)


def assert_same_episode(ours, theirs, actions, **reset):
    (observation, info), (other, other_info) = ours.reset(**reset), theirs.reset(**reset)
    assert_same_observation(observation, other)
    assert info == other_info
    for action in actions:
        step, other = ours.step(action), theirs.step(action)
        assert_same_observation(step[0], other[0])
        assert bits(step[1]) == bits(other[1])
        assert step[2:4] == other[2:4]
        assert_same_info(step[4], other[4])
        goals = other[0]["achieved_goal"], other[0]["desired_goal"]
        rewards = [env.unwrapped.compute_reward(*goals, {}) for env in (ours, theirs)]
        assert bits(rewards[0]) == bits(rewards[1])


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_episodes_have_the_same_bits(reference, env_id, precision):
    ours, theirs = pair(reference, env_id)
    random = np.random.default_rng(7)
    for reset in ({"seed": 11}, {}, {"seed": 2**63}):
        actions = random.uniform(-1.5, 1.5, (50, 4)).astype(precision)
        assert_same_episode(ours, theirs, actions, **reset)


def test_random_numbers_are_in_the_same_state(reference, task_id):
    ours, theirs = (env.unwrapped for env in pair(reference, task_id))
    for reset in ({"seed": 5}, {}, {}):
        ours.reset(**reset)
        theirs.reset(**reset)
        assert ours.np_random.bit_generator.state == theirs.np_random.bit_generator.state
        assert ours.np_random_seed == theirs.np_random_seed == 5


def test_actions_of_other_types_are_computed_as_theirs(reference):
    ours, theirs = (env.unwrapped for env in pair(reference, "FetchPush-v4"))
    for kind in (np.float16, np.int8, np.int64, list):
        numbers = np.array([0.7, -0.3, 0.2, 1.0]) * (1 if kind in (np.float16, list) else 3)
        action = numbers.tolist() if kind is list else numbers.astype(kind)
        ours.reset(seed=1)
        theirs.reset(seed=1)
        assert_same_observation(ours.step(action)[0], theirs.step(action)[0])


def test_rewards_of_batches_have_the_same_bits_and_types(reference, env_id):
    ours, theirs = (env.unwrapped for env in pair(reference, env_id))
    goals = np.random.default_rng(0).uniform(0, 0.1, (2, 5, 40, 3))
    for batch in (goals, goals[:, 0], goals[:, :1, :0]):
        rewards = [env.compute_reward(*batch, {}) for env in (ours, theirs)]
        assert rewards[0].dtype == rewards[1].dtype
        assert rewards[0].tobytes() == rewards[1].tobytes()
    single = [env.compute_reward(*goals.astype(np.float32), {}) for env in (ours, theirs)]
    assert single[0].dtype == single[1].dtype
    # Ours are rounded once, theirs after each operation.
    np.testing.assert_allclose(*single, rtol=3e-7)


def test_the_spaces_are_theirs(reference, env_id):
    ours, theirs = pair(reference, env_id)
    assert ours.action_space == theirs.action_space
    assert ours.observation_space == theirs.observation_space
    assert ours.unwrapped.dt == theirs.unwrapped.dt
    assert ours.metadata["render_fps"] == theirs.metadata["render_fps"]
    assert fetch_env.ENV_IDS.count(env_id) == 1
