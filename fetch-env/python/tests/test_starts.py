"""Starts that options set: the object, the gripper, and a function for each episode."""

import copy

import fetch_env
import gymnasium
import numpy as np
import pytest

STAY = np.array([0.0, 0.0, 0.0, -1.0], np.float32)


def test_the_gripper_holds_the_object_where_the_options_say():
    """It is lifted with it."""
    env = gymnasium.make("fetch_env/FetchPickAndPlace-v4")
    options = {"gripper_position": [1.4, 0.6, 0.6], "object_in_gripper": True}
    start, _ = env.reset(seed=0, options=options)
    assert np.allclose(start["observation"][:3], [1.4, 0.6, 0.6], atol=2e-3)
    for _ in range(10):
        observation = env.step(np.array([0, 0, 0.5, -1], np.float32))[0]
    assert np.linalg.norm(observation["achieved_goal"] - observation["observation"][:3]) < 0.02
    assert observation["achieved_goal"][2] > 0.7


def test_the_object_lies_as_the_options_say():
    """Raised and turned."""
    env = gymnasium.make("fetch_env/FetchPush-v4")
    half = 0.3
    turned = [np.cos(half), 0, 0, np.sin(half)]
    options = {"object_position": [1.3, 0.9], "object_height": 0.5, "object_rotation": turned}
    start, _ = env.reset(seed=0, options=options)
    assert np.allclose(start["achieved_goal"], [1.3, 0.9, 0.5], atol=1e-3)
    assert np.isclose(start["observation"][13], 2 * half, atol=1e-3)


def test_each_environment_of_a_vector_has_its_own_options():
    """In arrays with a row for each, or in a list."""
    envs = gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=3)
    places = np.array([[1.25, 0.7], [1.3, 0.8], [1.4, 0.9]])
    starts, _ = envs.reset(seed=0, options={"object_position": places, "object_height": 0.5})
    assert np.allclose(starts["achieved_goal"][:, :2], places, atol=1e-3)
    assert np.allclose(starts["achieved_goal"][:, 2], 0.5, atol=1e-3)
    drawn, _ = envs.reset(seed=0)
    each = [{"desired_goal": [1.3, 0.7, 0.5]}, None, {"object_position": [1.4, 0.9]}]
    starts, _ = envs.reset(seed=0, options=each)
    assert starts["desired_goal"][0].tolist() == [1.3, 0.7, 0.5]
    assert np.array_equal(starts["observation"][1], drawn["observation"][1])
    assert np.allclose(starts["achieved_goal"][2, :2], [1.4, 0.9], atol=1e-3)
    with pytest.raises(ValueError, match="there are options of 2 environments: pass 3"):
        envs.reset(options=each[:2])


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("num_threads", [1, 2])
def test_a_function_chooses_the_options_of_every_episode(mode, num_threads):
    """Also of those that begin by themselves."""

    def heights(env_index: int, episode: int) -> dict[str, float] | None:
        return {"object_height": 0.5 + 0.1 * env_index + 0.01 * episode} if env_index else None

    envs = fetch_env.FetchVectorEnv(
        "FetchPush-v4",
        2,
        autoreset_mode=mode,
        num_threads=num_threads,
        max_episode_steps=2,
        episode_options=heights,
    )
    begun = [envs.reset(seed=0)[0]]
    for _ in range(2):
        for _ in range(2 if mode == "SameStep" else 3):
            observations = envs.step(np.stack([STAY, STAY]))[0]
        begun.append(observations)
    assert [round(start["achieved_goal"][1, 2], 3) for start in begun] == [0.6, 0.61, 0.62]
    assert all(start["achieved_goal"][0, 2] < 0.43 for start in begun)


def test_copies_go_on_with_the_function():
    """The number of episodes is part of a vector's state."""

    def heights(env_index: int, episode: int) -> dict[str, float]:
        return {"object_height": 0.5 + 0.1 * env_index + 0.01 * episode}

    def make() -> fetch_env.FetchVectorEnv:
        return fetch_env.FetchVectorEnv(
            "FetchPush-v4", 2, max_episode_steps=1, episode_options=heights
        )

    envs, other = make(), make()
    envs.reset(seed=0)
    actions = np.stack([STAY, STAY])
    envs.step(actions)
    other.set_state(envs.get_state())
    for each in (envs, copy.deepcopy(envs), other):
        assert np.allclose(each.step(actions)[0]["achieved_goal"][:, 2], [0.51, 0.61], atol=1e-3)


def test_what_the_function_raises_reaches_the_caller():
    """The vector goes on."""

    def fails(env_index: int, episode: int) -> None:
        if episode > 0:
            message = f"no more episodes for {env_index}"
            raise LookupError(message)

    envs = fetch_env.FetchVectorEnv("FetchReach-v4", 2, max_episode_steps=1, episode_options=fails)
    envs.reset(seed=0)
    actions = np.zeros((2, 4), np.float32)
    envs.step(actions)
    with pytest.raises(LookupError, match="no more episodes for"):
        envs.step(actions)
    envs.step(actions)
    env = fetch_env.FetchEnv("FetchReach-v4", episode_options=fails)
    env.reset()
    with pytest.raises(LookupError, match="no more episodes for 0"):
        env.reset()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"gripper_position": [3, 0, 0]}, "the gripper gets from .* and not to the option"),
        ({"object_rotation": [0, 0, 0, 0]}, "the option object_rotation has the length 0"),
        ({"object_in_gripper": True}, "object_in_gripper needs fingers that open"),
        ({"object_height": [0.5]}, r"object_height has the shape \(1,\): pass a number"),
    ],
)
def test_impossible_starts_say_what_to_do(options, message):
    """In one environment."""
    env = gymnasium.make("fetch_env/FetchPush-v4")
    with pytest.raises(ValueError, match=message):
        env.reset(options=options)
