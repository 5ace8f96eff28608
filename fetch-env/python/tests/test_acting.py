"""Functions, and models of other packages, in place of policies."""

import time

import fetch_env
import numpy as np
import pytest

minari = pytest.importorskip("minari")

REACH = "FetchReach-v4"


def straight(observation):
    """Move straight to the goal."""
    way = (observation["desired_goal"] - observation["achieved_goal"]) / 0.05
    return np.concatenate([way, np.zeros_like(way[..., :1])], axis=-1).clip(-1, 1)


class Model:
    """A model as Stable-Baselines3 has it."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):  # noqa: FBT002
        assert deterministic
        assert (state, episode_start) == (None, None)
        assert observation["observation"].ndim == 2
        return straight(observation), None


@pytest.mark.parametrize("num_threads", [1, 3])
def test_all_that_acts_has_the_same_episodes(num_threads):
    def run(policy, **settings):
        return fetch_env.evaluate(REACH, policy, 20, seed=5, num_threads=num_threads, **settings)

    one = run(straight)
    assert one["success_rate"]["value"] == 1.0
    assert one == run(straight, batched=True) == run(Model())
    trained = fetch_env.Policy.shipped(REACH)
    assert run(trained) == run(trained.__call__)
    points = fetch_env.robustness(REACH, straight, "gravity", [9.81], 20, seed=5)["points"]
    assert points == [{"value": 9.81, **one}]


class Counting:
    """Acts by the number of steps since its reset."""

    def __init__(self):
        self.calls = []

    def reset(self):
        self.calls.append(0)

    def __call__(self, observation):
        assert {part: numbers.shape for part, numbers in observation.items()} == {
            "observation": (10,),
            "achieved_goal": (3,),
            "desired_goal": (3,),
        }
        self.calls[-1] += 1
        return [0.1 * self.calls[-1] / 50, 0, 0, 0]


def test_a_function_may_remember_its_episode():
    counting = Counting()
    fetch_env.evaluate(REACH, counting, 3)
    assert counting.calls == [50, 50, 50]


@pytest.mark.parametrize("batched", [False, True])
def test_errors_of_functions_are_the_callers(tmp_path, batched):
    calls = []

    def fails(observation):
        calls.append(observation)
        raise KeyError(len(calls))

    error = pytest.raises(KeyError)
    with error:
        fetch_env.evaluate(REACH, fails, batched=batched)
    with error:
        fetch_env.robustness(REACH, fails, "gravity", [9.81], batched=batched)
    with error:
        fetch_env.write_dataset(REACH, fails, tmp_path, name="mine", episodes=1, batched=batched)
    assert len(calls) == 3
    assert list(tmp_path.iterdir()) == []
    shape = r"the shape \(2,\): pass " + (r"\(16, 4\)" if batched else r"\(4,\)")
    with pytest.raises(ValueError, match=f"the action that the policy returned has {shape}"):
        fetch_env.evaluate(REACH, lambda _: [0.0, 1.0], batched=batched)
    with pytest.raises(ValueError, match="action"):
        fetch_env.evaluate(
            REACH, lambda _: np.full((16, 4)[1 - batched :], np.nan), batched=batched
        )
    with pytest.raises(TypeError, match=r"pass a fetch_env\.Policy, a function"):
        fetch_env.evaluate(REACH, "mine")


def test_ctrl_c_ends_a_function(ctrl_c):
    start = time.monotonic()
    ctrl_c.start()
    with pytest.raises(KeyboardInterrupt):
        fetch_env.evaluate(REACH, straight, 1_000_000)
    assert time.monotonic() - start < 10.0


def test_data_sets_are_written_by_functions(tmp_path, monkeypatch):
    summary = fetch_env.write_dataset(REACH, straight, tmp_path / "one", name="mine", episodes=3)
    assert summary == fetch_env.evaluate(REACH, straight, 3)
    fetch_env.write_dataset(REACH, Model(), tmp_path / "many", name="mine", episodes=3)
    loaded = []
    for folder in ("one", "many"):
        monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / folder))
        loaded.append(list(minari.load_dataset("fetch/reach/mine-v0")))
    for one, many in zip(*loaded, strict=True):
        np.testing.assert_array_equal(one.actions, many.actions)
        first = {part: numbers[0] for part, numbers in one.observations.items()}
        np.testing.assert_array_equal(one.actions[0], straight(first).astype(np.float32))
    with pytest.raises(TypeError, match="pass name="):
        fetch_env.write_dataset(REACH, straight, tmp_path)
    with pytest.raises(TypeError, match="pass name="):
        fetch_env.write_dataset(REACH, "random", tmp_path, name="mine")
