"""Gymnasium's own checks, and what `gymnasium.make` makes of the environments."""

import pathlib
import pickle
import warnings

import fetch_env
import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode


def test_gymnasiums_checker_finds_nothing(env_id):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(gymnasium.make(f"fetch_env/{env_id}").unwrapped)
    # Positions have no bounds, in the reference neither.
    rest = [str(warning.message) for warning in caught if "infinity" not in str(warning.message)]
    assert rest == []


def test_an_episode_is_truncated_after_fifty_steps(env_id):
    env = gymnasium.make(f"fetch_env/{env_id}")
    assert env.spec.max_episode_steps == 50
    env.reset(seed=0)
    ends = [env.step(env.action_space.sample())[2:4] for _ in range(50)]
    assert ends == [(False, False)] * 49 + [(False, True)]


def test_the_limit_of_gymnasium_counts():
    env = gymnasium.make("fetch_env/FetchReach-v4", max_episode_steps=60)
    env.reset(seed=0)
    ends = [env.step(env.action_space.sample())[3] for _ in range(60)]
    assert ends == [False] * 59 + [True]


def test_the_reward_is_that_of_the_goals(env_id, actions):
    env = fetch_env.FetchEnv(env_id)
    env.reset(seed=0)
    steps = [env.step(action) for action in actions]
    for observation, reward, _, _, info in steps:
        goals = observation["achieved_goal"], observation["desired_goal"]
        assert type(reward) is float
        assert reward == env.compute_reward(*goals, info)
        distance = np.linalg.norm(goals[0] - goals[1])
        assert info["is_success"] == (distance < env.distance_threshold)
    batch = [
        np.array([step[0][key] for step in steps]) for key in ("achieved_goal", "desired_goal")
    ]
    rewards = env.compute_reward(*batch)
    assert rewards.dtype == (np.float64 if "Dense" in env_id else np.float32)
    assert rewards.tolist() == [step[1] for step in steps]
    boxes = [goals.reshape(3, 20, 3) for goals in batch]
    assert env.compute_reward(*boxes).tolist() == rewards.reshape(3, 20).tolist()
    assert env.compute_reward(*(goals.astype(np.float32) for goals in batch)).dtype == np.float32
    assert not env.compute_terminated(*boxes).any()
    assert env.compute_truncated(*batch).shape == (60,)
    assert env.compute_terminated(batch[0][0], batch[1][0]) is False


def test_the_reward_type_replaces_that_of_the_name():
    for made in (
        gymnasium.make("fetch_env/FetchPush-v4", reward_type="dense"),
        gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=2, reward_type="dense"),
    ):
        env = made.unwrapped
        assert env.reward_type == "dense"
        assert env.config_arguments()["reward_type"] == "dense"
        observation, _ = env.reset(seed=0)
        goals = observation["achieved_goal"], observation["desired_goal"]
        np.testing.assert_allclose(
            env.compute_reward(*goals), -np.linalg.norm(goals[0] - goals[1], axis=-1)
        )


def test_what_is_returned_is_not_reused(push, actions):
    first = push.step(actions[0])[0]
    copy = {key: numbers.copy() for key, numbers in first.items()}
    first["observation"] += 1.0
    push.step(actions[1])
    assert all(np.array_equal(first[key], copy[key] + (key == "observation")) for key in first)


def test_a_reset_takes_goal_and_object():
    env = fetch_env.FetchEnv("FetchPush-v4")
    goal, position = np.array([1.3, 0.8, 0.42]), (1.25, 0.6)
    observation, info = env.reset(
        seed=3, options={"desired_goal": goal, "object_position": position}
    )
    assert info == {}
    assert observation["desired_goal"].tolist() == goal.tolist() == env.goal.tolist()
    np.testing.assert_allclose(observation["achieved_goal"][:2], position, atol=1e-9)


def test_a_video_lasts_as_long_as_the_episode():
    for n_substeps, frames in ((20, 25), (10, 50)):
        env = gymnasium.make("fetch_env/FetchPush-v4", n_substeps=n_substeps)
        envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2, n_substeps=n_substeps)
        assert env.metadata["render_fps"] == envs.metadata["render_fps"] == frames
        assert frames == 1 / env.unwrapped.dt
    assert fetch_env.FetchEnv.metadata["render_fps"] == 25


def test_a_spec_is_written_and_read():
    folder = pathlib.Path("builtin")  # a name that needs no files
    env = gymnasium.make("fetch_env/FetchPush-v4", model=folder, target_offset=(0.1, 0.0, 0.0))
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config_arguments()["model"] == "builtin"
    assert again.unwrapped.target_offset[0] == 0.1
    envs = gymnasium.make_vec(
        "fetch_env/FetchPush-v4", num_envs=2, model=folder, autoreset_mode=AutoresetMode.SAME_STEP
    )
    spec = EnvSpec.from_json(envs.spec.to_json())
    assert spec.kwargs["autoreset_mode"] == "SameStep"
    assert pickle.loads(pickle.dumps(env)).spec == env.spec
    assert gymnasium.spec("fetch_env/FetchPush-v4").kwargs == {"env_id": "FetchPush-v4"}


@pytest.mark.parametrize("mode", ["rgb_array", "depth_array"])
def test_pictures_have_the_size_that_was_asked_for(mode):
    env = gymnasium.make("fetch_env/FetchPush-v4", render_mode=mode, width=64, height=48)
    env.reset(seed=0)
    before = env.unwrapped.get_state()
    picture = env.render()
    assert picture.shape == ((48, 64, 3) if mode == "rgb_array" else (48, 64))
    assert picture.dtype == (np.uint8 if mode == "rgb_array" else np.float32)
    assert picture.std() > 0
    assert env.unwrapped.get_state() == before
    assert np.array_equal(env.render(), picture)
