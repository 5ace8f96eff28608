"""What programs call of the reference's own methods and modules."""

# ruff: noqa: SLF001

import copy

import fetch_env
import gymnasium
import numpy as np
import pytest
from reference import assert_same_observation


def test_methods_that_programs_call_are_the_references(reference, task_id, actions):
    ours = fetch_env.FetchEnv(task_id, model="reference")
    theirs = reference(task_id).unwrapped
    for env in (ours, theirs):
        env.reset(seed=4)
    for action in actions[:5]:
        observation = ours.step(action)[0]
        theirs.step(action)
        assert_same_observation(ours._get_obs(), theirs._get_obs())
        assert_same_observation(ours._get_obs(), observation)
        goals = [env._sample_goal() for env in (ours, theirs)]
        np.testing.assert_array_equal(*goals)
        np.testing.assert_array_equal(ours.goal, observation["desired_goal"])
        ours.goal = theirs.goal = goals[0]
    assert_same_observation(ours._get_obs(), theirs._get_obs())
    # What was drawn is missing from the numbers that follow.
    assert ours.np_random.random() == copy.deepcopy(theirs.np_random).random()
    assert_same_observation(ours.reset()[0], theirs.reset()[0])
    for goals in (np.zeros((2, 3)), np.zeros((2, 4, 3)) + np.eye(3)[0] * 0.04):
        results = [env._is_success(goals[0], goals[1] * 2) for env in (ours, theirs)]
        np.testing.assert_array_equal(*results)
        assert type(results[0]) is type(results[1])
        assert results[0].dtype == results[1].dtype


def test_a_drawn_goal_is_part_of_the_state(push):
    state = push.get_state()
    goals = [push._sample_goal() for _ in range(3)]
    assert push.get_state() != state
    push.set_state(state)
    np.testing.assert_array_equal([push._sample_goal() for _ in range(3)], goals)
    with pytest.raises(gymnasium.error.ResetNeeded):
        fetch_env.FetchEnv("FetchPush-v4")._sample_goal()


def test_the_references_functions_read_the_copies(reference, actions):
    # Push moves the state forward after each step, so the reference's quantities are as new.
    ours, theirs = fetch_env.FetchEnv("FetchPush-v4", model="reference"), reference("FetchPush-v4")
    for env in (ours, theirs):
        env.reset(seed=1)
        env.step(actions[0])
    for env in (ours, theirs.unwrapped):
        assert env._utils.__name__ == "gymnasium_robotics.utils.mujoco_utils"
        assert env._mujoco is pytest.importorskip("mujoco")
        assert "robot0:slide0" in env._model_names.joint_names
    for name in ("get_site_xpos", "get_site_xvelp", "get_site_xmat"):
        values = [
            getattr(env._utils, name)(env.model, env.data, "object0")
            for env in (ours, theirs.unwrapped)
        ]
        np.testing.assert_allclose(*values, atol=1e-12)
    np.testing.assert_array_equal(ours._get_gripper_xpos(), theirs.unwrapped._get_gripper_xpos())
    with pytest.raises(ValueError, match="read-only"):
        ours._utils.set_joint_qpos(ours.model, ours.data, "object0:joint", np.zeros(7))
