"""The simulation as objects of the package `mujoco`."""

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
    data.qpos[:] = 0.0
    assert env.data.qpos.any()


def test_a_reset_returns_to_the_settled_scene(task_id):
    env = fetch_env.FetchEnv(task_id)
    env.reset(seed=24)
    end = None if "Reach" in task_id else -7
    np.testing.assert_array_equal(env.data.qpos[:end], env.initial_qpos[:end])
    np.testing.assert_array_equal(env.data.qvel, env.initial_qvel)
    first = env.data.qpos
    env.reset(seed=24)
    np.testing.assert_array_equal(env.data.qpos, first)
