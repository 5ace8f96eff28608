"""skrl takes one environment and vectors."""

import fetch_env  # noqa: F401 (registers the environments)
import gymnasium
import pytest
import torch
from skrl.envs.wrappers.torch import wrap_env


@pytest.mark.parametrize("num_envs", [None, 3])
def test_episodes_have_50_steps(num_envs):
    """Observations come as one row for each environment, and all are truncated together."""
    env_id = "fetch_env/FetchPush-v4"
    env = gymnasium.make(env_id) if num_envs is None else gymnasium.make_vec(env_id, num_envs)
    wrapped, count = wrap_env(env, wrapper="gymnasium"), num_envs or 1
    observations, _ = wrapped.reset()
    for step in range(1, 51):
        observations, rewards, _, truncated, _ = wrapped.step(torch.zeros(count, 4))
        assert truncated.flatten().tolist() == [step == 50] * count
    assert observations.shape == (count, 31)
    assert rewards.tolist() == [[-1.0]] * count
