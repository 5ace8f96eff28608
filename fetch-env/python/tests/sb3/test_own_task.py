"""A task in Python under Stable-Baselines3."""

import runpy
from pathlib import Path

import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from fetch_env import sb3
from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import DummyVecEnv

EXAMPLE = Path(__file__).parents[2] / "examples" / "obstacle.py"
ID = "FetchPush-v4"


@pytest.mark.parametrize("many", [True, False])
def test_a_task_is_learned_in_hindsight_with_its_own_rewards(many):
    task = runpy.run_path(str(EXAMPLE))["Obstacle"]()
    if many:
        envs = sb3.FetchVecEnv(ID, 2, task=task)
    else:
        envs = DummyVecEnv([lambda: gymnasium.make(f"fetch_env/{ID}", task=task)] * 2)
    model = SAC(
        "MultiInputPolicy",
        envs,
        replay_buffer_class=sb3.HerReplayBuffer,
        buffer_size=1000,
        learning_starts=100,
        policy_kwargs={"net_arch": [8]},
        device="cpu",
        seed=0,
    )
    model.learn(220)
    batch = model.replay_buffer.sample(256)
    goals = [batch.next_observations[key].numpy() for key in ("achieved_goal", "desired_goal")]
    assert goals[0].shape == (256, 5)
    rewards = task.compute_reward(*goals, None)
    np.testing.assert_allclose(batch.rewards[:, 0].numpy(), rewards)
    assert batch.observations["observation"].shape == (256, 29)
