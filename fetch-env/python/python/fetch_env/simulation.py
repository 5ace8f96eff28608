"""The simulation as objects of the package `mujoco`, for code that reads them."""

from __future__ import annotations

import copy
import functools
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from . import _native

#: What is found by name or id in a model and in data, and the name of its number.
PARTS = {
    "actuator": "nu",
    "body": "nbody",
    "camera": "ncam",
    "equality": "neq",
    "geom": "ngeom",
    "joint": "njnt",
    "key": "nkey",
    "light": "nlight",
    "mat": "nmat",
    "sensor": "nsensor",
    "site": "nsite",
    "tendon": "ntendon",
    "tex": "ntex",
}


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
    for part in (model, model.opt, model.stat):
        freeze(part)
    freeze_parts(model, model)
    return model


def data_of(native: _native.Env, model: Any) -> Any:
    """Return the current state as a ``mujoco.MjData`` of the model."""
    import mujoco  # noqa: PLC0415

    data = read_only_data()(model)
    state = native.simulation()
    mujoco.MjData.time.__set__(data, state["time"])
    for name in ("qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat"):
        getattr(data, name)[:] = state[name]
    mujoco.mj_forward(model, data)
    # Normalizing has changed the last bits of quaternions.
    data.qpos[:] = state["qpos"]
    freeze(data)
    freeze_parts(data, model)
    return data


@functools.cache
def read_only_data() -> Any:
    """Return the class of data whose copies, but not itself, can be written to."""
    import mujoco  # noqa: PLC0415

    class ReadOnlyData(mujoco.MjData):  # type: ignore[misc]
        def __setattr__(self, name: str, value: object) -> None:
            message = (
                f"data.{name} cannot be assigned, because data is a copy of the simulation: write "
                "to copy.copy(data), or use reset() with options, and set_state()"
            )
            raise AttributeError(message)

        def __reduce_ex__(self, _protocol: object) -> Any:
            return copy.copy, (copy.copy(self),)

    return ReadOnlyData


def freeze(part: Any) -> None:
    """Make the arrays of an object refuse to be written to."""
    for name in dir(part):
        if isinstance(array := getattr(part, name, None), np.ndarray):
            array.flags.writeable = False


def freeze_parts(parts: Any, model: Any) -> None:
    """Do so with what is found by name or id."""
    for kind, count in PARTS.items():
        if find := getattr(parts, kind, None):
            for index in range(getattr(model, count)):
                freeze(find(index))


def start_of(native: _native.Env) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return the positions and velocities of the settled scene."""
    state = native.simulation()
    return state["initial_qpos"], state["initial_qvel"]
