"""What is refused, and what the message advises."""

import importlib
import sys

import fetch_env
import gymnasium
import numpy as np
import pytest


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"env_id": "FetchPusher-v4"}, "the nearest are FetchPush-v4"),
        ({"env_id": "FetchReach-v4", "object_range": 0.2}, "Reach has no object"),
        ({"env_id": "FetchPush-v4", "n_substeps": 0}, "n_substeps is 0"),
        ({"env_id": "FetchPush-v4", "distance_threshold": -1.0}, "-1"),
        ({"env_id": "FetchPush-v4", "target_range": float("nan")}, "target_range is NaN"),
        ({"env_id": "FetchPush-v4", "render_mode": "ascii"}, "rgb_array"),
        ({"env_id": "FetchPush-v4", "reward_type": "shaped"}, 'pass "sparse" or "dense"'),
        ({"env_id": "FetchPush-v4", "n_substeps": -1}, r"-1 is out of range: .* 0 to 2\*\*32 - 1"),
        ({"env_id": "FetchPush-v4", "width": 5000}, "5000 x 480 pixels"),
        ({"env_id": "FetchPush-v4", "height": -1}, "from 0 to"),
    ],
)
def test_settings_that_mean_nothing(settings, message):
    for make in (fetch_env.FetchEnv, fetch_env.FetchVectorEnv):
        with pytest.raises(ValueError, match=message):
            make(**settings)


@pytest.mark.parametrize("name", ["num_envs", "num_threads", "max_episode_steps"])
def test_negative_numbers_mean_nothing(name):
    with pytest.raises(ValueError, match="from 0 to"):
        fetch_env.FetchVectorEnv("FetchPush-v4", **{name: -1})


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"distance_treshold": 0.1}, "argument 'distance_treshold': did you mean distance_thresh"),
        ({"obj_range": 0.1}, "did you mean object_range"),
        ({"frame_skip": 3}, "the settings are model, reward_type"),
    ],
)
def test_settings_that_do_not_exist(settings, message):
    policy = fetch_env.Policy.shipped("FetchPush-v4")
    for call in (
        lambda: fetch_env.FetchEnv("FetchPush-v4", **settings),
        lambda: fetch_env.FetchVectorEnv("FetchPush-v4", **settings),
        lambda: fetch_env.train("FetchPush-v4", **settings),
        lambda: fetch_env.evaluate("FetchPush-v4", policy, **settings),
        lambda: fetch_env.write_dataset("FetchPush-v4", "random", "nowhere", **settings),
        lambda: gymnasium.make("fetch_env/FetchPush-v4", **settings),
    ):
        with pytest.raises(TypeError, match=message):
            call()


def test_one_environment_has_no_time_limit():
    with pytest.raises(TypeError, match=r"gymnasium.make, or use gymnasium.wrappers.TimeLimit"):
        fetch_env.FetchEnv("FetchPush-v4", max_episode_steps=3)
    assert gymnasium.make("fetch_env/FetchPush-v4", max_episode_steps=3).spec.max_episode_steps == 3


def test_a_model_that_is_missing(tmp_path):
    with pytest.raises(FileNotFoundError, match="download_reference_model"):
        fetch_env.FetchEnv("FetchPush-v4", model=tmp_path)


def test_a_step_before_the_reset():
    env = fetch_env.FetchEnv("FetchPush-v4")
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        env.step(np.zeros(4, np.float32))
    assert env._np_random is None  # noqa: SLF001
    assert env.np_random_seed is None


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros(3, np.float32), "3 elements: pass 4"),
        (np.zeros((1, 4), np.float32), r"\(4,\)"),
        (np.float32(1.0), r"\(4,\)"),
        ([0.0, float("nan"), 0.0, 0.0], r"action\[1\] is NaN"),
        ([0.0, 0.0, float("inf"), 0.0], r"action\[2\] is inf"),
    ],
)
def test_actions_that_mean_nothing_change_nothing(push, action, message):
    before = push.get_state()
    with pytest.raises(ValueError, match=message):
        push.step(action)
    assert push.get_state() == before


@pytest.mark.parametrize("action", ["up", [0.0, None, 0.0, 0.0]])
def test_actions_that_are_no_numbers(push, action):
    with pytest.raises((TypeError, ValueError)):
        push.step(action)


@pytest.mark.parametrize("seed", [-1, 2**64, 1.5, "one"])
def test_seeds_that_mean_nothing(push, seed):
    with pytest.raises(ValueError, match="from 0 to"):
        push.reset(seed=seed)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"goal": [1.0, 1.0, 1.0]}, "desired_goal"),
        ({"desired_goal": [1.0, 1.0]}, r"desired_goal has the shape \(2,\): pass \(3,\)"),
        ({"desired_goal": [[1.0, 1.0, 0.5]]}, r"desired_goal has the shape \(1, 3\): pass"),
        ({"desired_goal": [1.0, 1.0, float("nan")]}, "index 2"),
        ({"object_position": [1.0]}, r"object_position has the shape \(1,\): pass \(2,\)"),
        ({"object_position": [[1.3], [0.7]]}, r"object_position has the shape \(2, 1\)"),
    ],
)
def test_options_that_mean_nothing(push, options, message):
    before = push.get_state()
    with pytest.raises(ValueError, match=message):
        push.reset(options=options)
    assert push.get_state() == before


def test_reach_has_no_object_to_place():
    env = fetch_env.FetchEnv("FetchReach-v4")
    with pytest.raises(ValueError, match='Reach has no object: leave out "object_position"'):
        env.reset(options={"object_position": [1.3, 0.7]})


def test_arrays_that_are_not_aligned_are_copied(push):
    state = push.get_state()
    expected = push.step(np.full(4, 0.5, np.float32))[0]
    push.set_state(state)
    action = np.zeros(17, np.uint8)[1:].view(np.float32)
    action[:] = 0.5
    assert not action.flags.aligned
    np.testing.assert_array_equal(push.step(action)[0]["observation"], expected["observation"])


def test_goals_that_do_not_fit(push):
    with pytest.raises(ValueError, match="at most 32 dimensions"):
        push.compute_reward(*np.zeros((2, *[1] * 32, 3)))
    with pytest.raises(ValueError, match="same shape"):
        push.compute_reward(np.zeros((2, 3)), np.zeros(3))
    for compute in (push.compute_reward, push.compute_terminated, push.compute_truncated):
        for shape in ((3, 8), (6,), (2, 1), (), (0,)):
            with pytest.raises(
                ValueError, match=r"the goals have the shape .*: pass \(\.\.\., 3\)"
            ):
                compute(np.zeros(shape), np.zeros(shape))
    with pytest.raises(ValueError, match="NaN"):
        push.compute_reward(np.zeros(3), np.full(3, np.nan))


def test_a_closed_environment_says_so(push):
    push.close()
    push.close()
    for call in (push.reset, push.get_state, lambda: push.step(np.zeros(4, np.float32))):
        with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="closed"):
            call()


def test_the_random_numbers_are_not_replaced(push):
    with pytest.raises(AttributeError, match="seed"):
        push.np_random = np.random.default_rng(0)


def test_what_gymnasium_makes_needs_a_reset_first():
    env = gymnasium.make("fetch_env/FetchPush-v4", render_mode="rgb_array", width=32, height=32)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(4, np.float32))
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.render()


def test_rendering_without_a_mode_warns(push):
    with pytest.warns(UserWarning, match="rgb_array"):
        assert push.render() is None


def test_a_missing_lerobot_says_what_to_install(monkeypatch):
    for name in [name for name in sys.modules if name.startswith("fetch_env.lerobot")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "lerobot", None)
    with pytest.raises(ImportError, match=r"pip install 'fetch-env\[lerobot\]'"):
        importlib.import_module("fetch_env.lerobot")
