"""The simulation as objects of the package `mujoco`."""

import copy
import pickle
import sys

import fetch_env
import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")


@pytest.mark.parametrize("model", ["builtin", "reference"])
def test_the_state_is_the_simulations(task_id, actions, model):
    if model == "reference" and not fetch_env.has_reference_model():
        pytest.skip("the reference's model is not there")
    env = fetch_env.FetchEnv(task_id, model=model)
    env.reset(seed=1)
    assert env.model is env.model
    for action in actions[:5]:
        observation = env.step(action)[0]
    data = env.data
    assert data is not env.data
    grip = mujoco.mj_name2id(env.model, mujoco.mjtObj.mjOBJ_SITE, "robot0:grip")
    # PickAndPlace observes positions that are one substep old.
    np.testing.assert_allclose(data.site_xpos[grip], observation["observation"][:3], atol=2e-3)
    mujoco.mj_step(env.model, data)
    assert env.data.time < data.time


def test_copies_refuse_to_be_written_to(push):
    model, data = push.model, push.data
    for write in (
        lambda: data.qpos.fill(0.0),
        lambda: data.joint("object0:joint").qpos.fill(0.0),
        lambda: data.body("robot0:base_link").xpos.fill(0.0),
        lambda: model.body_mass.fill(0.0),
        lambda: model.body("object0").mass.fill(0.0),
        lambda: model.opt.gravity.fill(0.0),
    ):
        with pytest.raises(ValueError, match="read-only"):
            write()
    for name, value in {"time": 1.0, "qpos": data.qpos}.items():
        with pytest.raises(AttributeError, match="copy"):
            setattr(data, name, value)
    for again in (copy.copy, copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))):
        mine, state = again(model), again(data)
        mine.opt.gravity[:] = 0.0
        state.time = 5.0
        state.joint("object0:joint").qpos[:] = 1.0
        mujoco.mj_step(mine, state)
        assert state.time > 5.0


def test_without_mujoco_there_are_no_copies(push, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert not hasattr(push, "model")
    assert not hasattr(push, "data")
    with pytest.raises(AttributeError, match=r"model: .*mujoco"):
        _ = push.model


def test_a_reset_returns_to_the_settled_scene(task_id):
    env = fetch_env.FetchEnv(task_id)
    env.reset(seed=24)
    end = None if "Reach" in task_id else -7
    np.testing.assert_array_equal(env.data.qpos[:end], env.initial_qpos[:end])
    np.testing.assert_array_equal(env.data.qvel, env.initial_qvel)
    first = env.data.qpos
    env.reset(seed=24)
    np.testing.assert_array_equal(env.data.qpos, first)
