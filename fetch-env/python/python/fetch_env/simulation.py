"""The simulation as objects of the package `mujoco`, for code that reads them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

    from . import _native


def model_of(native: _native.Env) -> Any:
    """Compile the environment's scene as a ``mujoco.MjModel``."""
    import mujoco  # noqa: PLC0415

    scene = native.scene()
    if isinstance(scene, str):
        model = mujoco.MjModel.from_xml_path(scene)
    else:
        main, files = scene
        others = {name: text.encode() for name, text in files.items() if name != main}
        model = mujoco.MjModel.from_xml_string(files[main], others)
    # As the reference sets it: the gripper is held at the mocap body's pose.
    welds = model.eq_type == mujoco.mjtEq.mjEQ_WELD
    model.eq_data[welds, :7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    return model


def data_of(native: _native.Env, model: Any) -> Any:
    """Return the current state as a ``mujoco.MjData`` of the model."""
    import mujoco  # noqa: PLC0415

    data = mujoco.MjData(model)
    state = native.simulation()
    data.time = state["time"]
    for name in ("qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat"):
        getattr(data, name)[:] = state[name]
    mujoco.mj_forward(model, data)
    # Normalizing has changed the last bits of quaternions.
    data.qpos[:] = state["qpos"]
    return data


def start_of(native: _native.Env) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return the positions and velocities of the settled scene."""
    state = native.simulation()
    return state["initial_qpos"], state["initial_qvel"]
