"""The attributes of the reference's environments: read, assigned and refused."""

import copy
import pickle

import fetch_env
import gymnasium
import numpy as np
import pytest
from reference import assert_same_observation

#: What the reference has, with its value.
NAMES = (
    "block_gripper",
    "distance_threshold",
    "dt",
    "gripper_extra_height",
    "has_object",
    "height_offset",
    "initial_gripper_xpos",
    "initial_qpos",
    "initial_qvel",
    "n_substeps",
    "obj_range",
    "reward_type",
    "target_in_the_air",
    "target_offset",
    "target_range",
)
VALUES = {
    "obj_range": 0.2,
    "target_range": 0.05,
    "target_offset": (0.1, -0.2, 0.3),
    "target_in_the_air": True,
    "distance_threshold": 0.3,
    "reward_type": "dense",
}
NEED_AN_OBJECT = ("obj_range", "target_offset", "target_in_the_air")


def test_values_are_the_references(reference, task_id):
    ours = fetch_env.FetchEnv(task_id, model="reference")
    theirs = reference(task_id).unwrapped
    assert ours.goal.shape == theirs.goal.shape == (0,)
    for env in (ours, theirs):
        env.reset(seed=0)
    for name in (*NAMES, "goal"):
        assert hasattr(ours, name) == hasattr(theirs, name)
        if hasattr(ours, name):
            value, expected = getattr(ours, name), getattr(theirs, name)
            np.testing.assert_array_equal(value, np.broadcast_to(expected, np.shape(value)), name)


def assert_same_episodes(ours, theirs, actions):
    """Compare an episode that is under way, and the next one."""
    for env in (ours, theirs):
        env.reset(seed=7)
    for _ in range(2):
        for action in actions[:5]:
            one, other = (env.step(action) for env in (ours, theirs))
            assert_same_observation(one[0], other[0])
            np.testing.assert_array_equal(one[1], other[1])
            assert one[4]["is_success"] == other[4]["is_success"]
        assert_same_observation(ours.reset()[0], theirs.reset()[0])


@pytest.mark.parametrize("name", VALUES)
def test_what_is_assigned_has_the_references_effect(reference, task_id, actions, name):
    ours = gymnasium.make(f"fetch_env/{task_id}", model="reference")
    theirs = reference(task_id)
    value = VALUES[name]
    if "Reach" in task_id and name in NEED_AN_OBJECT:
        with pytest.raises(ValueError, match=f"{name} has no effect"):
            setattr(ours.unwrapped, name, value)
        return
    theirs.set_wrapper_attr(name, np.array(value) if name == "target_offset" else value)
    ours.set_wrapper_attr(name, value)
    np.testing.assert_array_equal(getattr(ours.unwrapped, name), value)
    assert_same_episodes(ours, theirs, actions)
    goals = np.zeros((2, 3)), np.full((2, 3), 0.1)
    results = [each.unwrapped.compute_reward(*goals, {}) for each in (ours, theirs)]
    np.testing.assert_array_equal(*results)
    assert results[0].dtype == results[1].dtype


def test_a_goal_counts_until_the_next_reset(reference, task_id, actions):
    ours = gymnasium.make(f"fetch_env/{task_id}", model="reference")
    theirs = reference(task_id)
    for env in (ours, theirs):
        observation, _ = env.reset(seed=3)
        env.step(actions[0])
        env.unwrapped.goal = observation["achieved_goal"].copy()
    for action in actions[1:5]:
        one, other = (env.step(action) for env in (ours, theirs))
        assert_same_observation(one[0], other[0])
        assert one[1] == other[1]
        assert one[4]["is_success"] == other[4]["is_success"]
    assert_same_observation(ours.reset()[0], theirs.reset()[0])


@pytest.mark.parametrize(
    "again", [copy.copy, copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))]
)
def test_copies_keep_what_was_assigned(push, again):
    push.distance_threshold, push.target_offset = 0.2, 0.1
    push.goal = [1.3, 0.7, 0.5]
    other = again(push)
    assert other.distance_threshold == 0.2
    assert other.config_arguments() == push.config_arguments()
    assert other.goal.tolist() == [1.3, 0.7, 0.5]
    other.distance_threshold = 0.3
    assert push.distance_threshold == 0.2
    # Settings are no part of a state.
    fresh = fetch_env.FetchEnv("FetchPush-v4")
    fresh.set_state(push.get_state())
    assert fresh.goal.tolist() == [1.3, 0.7, 0.5]
    assert fresh.distance_threshold == 0.05


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("goal", [1.0, 2.0], "2 elements: pass 3"),
        ("goal", [[1.0, 2.0, 3.0]], r"\[1, 3\]: pass \(3,\)"),
        ("goal", [1.0, np.nan, 0.0], "NaN at index 1"),
        ("goal", "up", "goal: "),
        ("distance_threshold", -1.0, "-1"),
        ("reward_type", "shaped", "sparse"),
        ("obj_range", 0.01, "0.075"),
        ("target_range", np.inf, "inf"),
        ("target_offset", [0.1, 0.2], r"\[2\]: pass x, y and z"),
    ],
)
def test_wrong_values_change_nothing(push, name, value, message):
    before = push.get_state(), push.config_arguments()
    with pytest.raises(ValueError, match=message):
        setattr(push, name, value)
    assert (push.get_state(), push.config_arguments()) == before


def test_a_goal_needs_an_episode():
    with pytest.raises(gymnasium.error.ResetNeeded):
        fetch_env.FetchEnv("FetchPush-v4").goal = np.zeros(3)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("n_substeps", "when you make"),
        ("dt", "n_substeps"),
        ("initial_gripper_xpos", "scene"),
        ("initial_qpos", "scene"),
        ("height_offset", "scene"),
        ("has_object", "task"),
        ("block_gripper", "task"),
        ("gripper_extra_height", "task"),
        ("model", "copy"),
        ("data", "copy"),
        ("sim", "set_state"),
        ("viewer", "set_state"),
        ("mujoco_renderer", "render"),
        ("_utils", "module"),
        ("_sample_goal", "never calls it"),
        ("_get_obs", "never calls it"),
        ("_render_callback", "never calls it"),
        ("object_range", "obj_range"),
        ("max_episode_steps", "TimeLimit"),
        ("np_random", "seed"),
    ],
)
def test_what_would_have_no_effect_is_refused(push, name, message):
    with pytest.raises(AttributeError, match=message):
        setattr(push, name, 1)


def test_arrays_cannot_be_written_to(push):
    for name in ("goal", "target_offset", "initial_gripper_xpos", "initial_qpos", "initial_qvel"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(push, name)[0] = 1.0


def test_hasattr_answers(push):
    push.close()
    for name in ("goal", "model", "data", "initial_qpos", "initial_gripper_xpos", "height_offset"):
        assert not hasattr(push, name)
    assert hasattr(fetch_env.FetchEnv("FetchPush-v4"), "goal")
    assert not hasattr(fetch_env.FetchEnv("FetchReach-v4"), "height_offset")


def test_a_vector_reads_what_its_environments_have_and_is_not_changed():
    envs = fetch_env.FetchVectorEnv("FetchSlide-v4", 2)
    one = fetch_env.FetchEnv("FetchSlide-v4")
    assert [goal.shape for goal in envs.get_attr("goal")] == [(0,), (0,)]
    for name in (*NAMES, "goal"):
        if name in ("initial_qpos", "initial_qvel"):
            continue
        for value in envs.get_attr(name):
            np.testing.assert_array_equal(value, getattr(one, name))
        with pytest.raises(AttributeError, match=name):
            setattr(envs, name, 1.0)
        if name != "goal":
            with pytest.raises(AttributeError, match=name):
                envs.set_attr(name, 1.0)


def test_methods_that_are_never_called_are_not_overridden():
    for name in ("_sample_goal", "_set_action"):
        with pytest.raises(TypeError, match=f"Own defines {name}: the environment never calls it"):
            type("Own", (fetch_env.FetchEnv,), {name: lambda _self: np.zeros(3)})


def test_what_cannot_be_called_says_what_to_use(push):
    for name, remedy in (("_set_action", "step"), ("_reset_sim", "reset"), ("sim", "data")):
        with pytest.raises(AttributeError, match=rf"^{name}: .*{remedy}"):
            getattr(push, name)


def test_the_references_keyword_for_a_goal(push):
    goals = np.zeros(3), np.ones(3)
    expected = push.compute_reward(*goals)
    assert push.compute_reward(achieved_goal=goals[0], goal=goals[1], info={}) == expected
    assert push.compute_reward(goals[0], desired_goal=goals[1]) == expected
    for wrong in ({}, {"goal": goals[1], "desired_goal": goals[1]}):
        with pytest.raises(TypeError, match="either desired_goal or"):
            push.compute_reward(goals[0], **wrong)
