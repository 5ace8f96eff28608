"""A world that varies between episodes."""

import copy
import pickle
import runpy
from pathlib import Path

import fetch_env
import gymnasium
import numpy as np
import pytest

VARIATION = {
    "object_mass": (0.5, 4.0),
    "friction": {"log_uniform": (0.5, 2.0)},
    "object_size": {"choice": [0.9, 1.0, 1.1]},
    "gravity": 9.0,
}


def make(**settings):
    """Make Push with the settings."""
    return gymnasium.make("fetch_env/FetchPush-v4", **settings)


def test_each_episode_draws_its_numbers():
    """They are within their ranges, in the info and in the attribute, and follow from the seed."""
    env, again, plain = make(variation=VARIATION), make(variation=VARIATION), make()
    masses = set()
    for episode in range(10):
        seed = 7 if episode == 0 else None
        observation, info = env.reset(seed=seed)
        numbers = info["variation"]
        assert numbers == env.unwrapped.variation
        assert numbers.keys() == VARIATION.keys()
        assert 0.5 <= numbers["object_mass"] <= 4.0
        assert 0.5 <= numbers["friction"] <= 2.0
        assert numbers["object_size"] in {0.9, 1.0, 1.1}
        assert numbers["gravity"] == 9.0
        masses.add(numbers["object_mass"])
        assert again.reset(seed=seed)[1]["variation"] == numbers
        # Goals and objects start where they do without a variation.
        other, info = plain.reset(seed=seed)
        assert info == {}
        assert np.array_equal(observation["desired_goal"], other["desired_goal"])
        assert np.array_equal(observation["achieved_goal"][:2], other["achieved_goal"][:2])
    assert len(masses) == 10


def test_options_set_numbers_for_one_episode():
    """Also where nothing is drawn."""
    env = make()
    _, info = env.reset(seed=0, options={"variation": {"object_mass": 1.5}})
    assert info["variation"] == {"object_mass": 1.5}
    _, info = env.reset(seed=0)
    assert info == {}


def test_colors_have_three_numbers():
    """They are drawn alike or each by itself, set by options, and seen."""
    variation = {"table_color": [(0.1, 0.2), 0.5, {"choice": [0.8, 0.9]}], "floor_color": (0, 1)}
    env = make(variation=variation, render_mode="rgb_array")
    _, info = env.reset(seed=0)
    numbers = info["variation"]
    assert 0.1 <= numbers["table_color_red"] <= 0.2
    assert numbers["table_color_green"] == 0.5
    assert numbers["table_color_blue"] in {0.8, 0.9}
    floor = {numbers[f"floor_color_{part}"] for part in ("red", "green", "blue")}
    assert len(floor) == 3
    drawn = env.render()
    _, info = env.reset(seed=0, options={"variation": {"table_color": np.array([1.0, 0.0, 0.0])}})
    assert [info["variation"][f"table_color_{part}"] for part in ("red", "green", "blue")] == [
        1.0,
        0.0,
        0.0,
    ]
    assert env.render()[..., 0].mean() > drawn[..., 0].mean() + 5

    envs = gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=2, variation=variation)
    colors = [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]
    envs.reset(options={"variation": {"table_color": colors, "object_color": [0, 1, 0]}})
    numbers = envs.get_attr("variation")
    assert [of_env["table_color_blue"] for of_env in numbers] == [0.3, 0.6]
    assert [of_env["object_color_green"] for of_env in numbers] == [1.0, 1.0]
    with pytest.raises(
        ValueError, match=r"table_color has the shape \(\): pass \(3,\), or \(2, 3\)"
    ):
        envs.reset(options={"variation": {"table_color": 0.5}})


def test_copies_and_states_have_the_numbers():
    """They continue with the same bits."""
    env = make(variation=VARIATION).unwrapped
    env.reset(seed=3)
    action = np.array([0.5, 0.2, -0.5, 0.0], np.float32)
    env.step(action)
    other = make(variation=VARIATION).unwrapped
    other.set_state(env.get_state())
    copies = [copy.deepcopy(env), pickle.loads(pickle.dumps(env)), other]
    for _ in range(20):
        expected = env.step(action)[0]["observation"]
        for each in copies:
            assert each.variation == env.variation
            assert np.array_equal(each.step(action)[0]["observation"], expected)


def test_a_vector_varies_each_environment():
    """Its numbers are those of single environments; options may have one for each."""
    envs = gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=3, variation=VARIATION)
    envs.reset(seed=5)
    numbers = envs.get_attr("variation")
    for env_index, of_env in enumerate(numbers):
        env = make(variation=VARIATION)
        assert env.reset(seed=5 + env_index)[1]["variation"] == of_env
    masses = np.array([0.5, 1.0, 2.0])
    envs.reset(options={"variation": {"object_mass": masses, "gravity": 5.0}})
    assert [of_env["object_mass"] for of_env in envs.get_attr("variation")] == masses.tolist()
    assert [of_env["gravity"] for of_env in envs.get_attr("variation")] == [5.0] * 3
    # An episode that begins by itself draws again.
    for _ in range(51):
        envs.step(np.zeros((3, 4), np.float32))
    drawn = [of_env["object_mass"] for of_env in envs.get_attr("variation")]
    assert not set(drawn) & set(masses)


@pytest.mark.parametrize(
    ("variation", "message"),
    [
        ({"object_mas": (1, 2)}, r'there is no factor "object_mas": the nearest are object_mass, '),
        ({"object_mass": (2, 1)}, "object_mass has the range from 2 to 1"),
        ({"object_mass": -1}, "object_mass is -1.0: pass numbers from 0.001 to 1000"),
        ({"object_mass": {"choice": []}}, "object_mass has nothing to choose from"),
        (
            {"object_mass": {"normal": (0, 1)}},
            r"object_mass is \{'normal': \(0, 1\)\}: pass a number",
        ),
        ({"object_mass": "heavy"}, "object_mass is heavy: pass a number, a range"),
        ({"table_color": [0, 1, 2]}, "table_color_blue is 2.0: pass numbers from 0 to 1"),
        ({"tabel_color": 0.5}, r'there is no factor "tabel_color": the nearest are table_color_'),
        ({3: 1.0}, "variation has the key 3: pass names"),
    ],
)
def test_wrong_variations_say_what_to_pass(variation, message):
    """When the environment is made, or at the latest in the first reset."""
    with pytest.raises(ValueError, match=message):
        make(variation=variation).reset()


def test_what_cannot_vary_is_refused():
    """There is no object in Reach."""
    with pytest.raises(ValueError, match="object_mass cannot vary here, because the scene has no"):
        fetch_env.FetchEnv("FetchReach-v4", variation={"object_mass": 1.0})
    env = make()
    with pytest.raises(ValueError, match=r"object_mass has the shape \(2,\): pass a number"):
        env.reset(options={"variation": {"object_mass": [1.0, 2.0]}})
    envs = gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=3)
    with pytest.raises(
        ValueError, match=r"object_mass has the shape \(2,\): pass a number, or \(3,\)"
    ):
        envs.reset(options={"variation": {"object_mass": [1.0, 2.0]}})


def test_buffers_know_other_dynamics():
    """Transitions of a varied world do not go into a plain one's buffer."""
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", num_envs=2, variation=VARIATION)
    buffer = fetch_env.HerBuffer(fetch_env.FetchVectorEnv("FetchPush-v4", num_envs=2), 1000)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match="variation"):
        buffer.record(envs)


def test_an_algorithm_of_ones_own_learns_in_worlds_that_vary():
    """The example improves over its generations, each candidate in worlds of its own."""
    example = Path(__file__).parents[1] / "examples" / "varied.py"
    returns, masses = runpy.run_path(str(example))["evolve"](6)
    assert np.mean(returns[-2:]) > np.mean(returns[:2]) + 1.5
    assert len(set(masses)) == len(masses)
    assert 0.5 <= min(masses) < 1.0
    assert 2.0 < max(masses) <= 4.0
