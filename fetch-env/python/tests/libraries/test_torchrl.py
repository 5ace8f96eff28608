"""TorchRL takes one environment and vectors."""

import fetch_env
import gymnasium
import pytest
from gymnasium.vector import AutoresetMode
from torchrl.envs import GymWrapper
from torchrl.envs.utils import check_env_specs


@pytest.mark.parametrize("mode", [None, AutoresetMode.DISABLED, AutoresetMode.SAME_STEP])
def test_the_specs_hold(mode):
    """Steps and resets return what TorchRL's specs say."""
    if mode is None:
        env = gymnasium.make("fetch_env/FetchPush-v4")
    else:
        env = fetch_env.FetchVectorEnv("FetchPush-v4", 3, autoreset_mode=mode)
    check_env_specs(GymWrapper(env))
