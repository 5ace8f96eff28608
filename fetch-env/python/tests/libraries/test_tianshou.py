"""tianshou steps the environments, and its hindsight buffer uses their rewards."""

import fetch_env  # noqa: F401 (registers the environments)
import gymnasium
import numpy as np
from tianshou.data import Batch, HERVectorReplayBuffer
from tianshou.env import DummyVectorEnv

ENV_ID = "fetch_env/FetchReach-v4"


def test_its_buffer_relabels_with_our_rewards():
    """Each drawn reward is that of the goals beside it, and hindsight achieves some of them."""
    one = gymnasium.make(ENV_ID).unwrapped

    def reward(achieved_goal, desired_goal):
        return one.compute_reward(achieved_goal, desired_goal, {})

    envs = DummyVectorEnv([lambda: gymnasium.make(ENV_ID) for _ in range(2)])
    buffer = HERVectorReplayBuffer(
        2000, 2, compute_reward_fn=reward, horizon=50, future_k=4.0, stack_num=1
    )
    random = np.random.default_rng(0)
    names = ("obs", "act", "rew", "terminated", "truncated", "obs_next")
    for seed in range(20):
        observations, _ = envs.reset(seed=seed)
        for _ in range(50):
            actions = random.uniform(-1, 1, (2, 4)).astype(np.float32)
            following, rewards, *ended, _ = envs.step(actions)
            rows = zip(observations, actions, rewards, *ended, following, strict=True)
            buffer.add(Batch([dict(zip(names, row, strict=True)) for row in rows]))
            observations = following
    batch, _ = buffer.sample(500)
    expected = reward(batch.obs_next.achieved_goal, batch.obs_next.desired_goal)
    np.testing.assert_array_equal(batch.rew, expected)
    assert 0 < np.mean(batch.rew == 0) < 1
