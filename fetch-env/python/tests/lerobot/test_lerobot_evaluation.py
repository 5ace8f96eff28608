"""The environment that LeRobot makes for its evaluation."""

import gymnasium
import numpy as np
import pytest

pytest.importorskip("lerobot.envs")

from fetch_env import lerobot
from lerobot.envs.configs import EnvConfig
from lerobot.envs.factory import make_env
from lerobot.envs.utils import env_to_policy_features, preprocess_observation

pytestmark = pytest.mark.filterwarnings("default")


@pytest.mark.parametrize("obs_type", ["environment_state_agent_pos", "pixels_agent_pos"])
def test_make_env_makes_what_the_settings_say(task_id, obs_type):
    config = EnvConfig.get_choice_class("fetch")(
        task=task_id, obs_type=obs_type, observation_width=64, observation_height=48
    )
    envs = make_env(config, n_envs=2)["fetch"][0]
    observation, _ = envs.reset(seed=[3, 4])
    seen = preprocess_observation(observation)
    wanted = env_to_policy_features(config)
    assert set(seen) == set(wanted) - {"action"}
    for name, numbers in seen.items():
        assert tuple(numbers.shape) == (2, *wanted[name].shape)
    assert all(env.task_description.endswith("target.") for env in envs.envs)
    original = gymnasium.make(f"fetch_env/{task_id}")
    expected, _ = original.reset(seed=4)
    assert np.array_equal(observation["agent_pos"][1][:3], expected["observation"][:3].astype("f4"))
    for step in range(50):
        _, rewards, _, truncated, info = envs.step(np.ones((2, 4), np.float32))
        _, reward, _, _, last = original.step(np.ones(4, np.float32))
        assert (rewards[1], truncated[1]) == (reward, step == 49)
    assert info["final_info"]["is_success"][1] == bool(last["is_success"])
    envs.close()


@pytest.mark.parametrize(
    ("setting", "message"),
    [({"task": "FetchPsh-v4"}, "FetchPush-v4"), ({"obs_type": "pixels"}, "pixels_agent_pos")],
)
def test_settings_are_checked(setting, message):
    with pytest.raises(ValueError, match=message):
        lerobot.FetchEnvConfig(**setting)
