"""The simulation as objects of the package `mujoco`, for code that reads them."""

from __future__ import annotations

import copy
import functools
import importlib
from typing import TYPE_CHECKING, Any

import numpy as np

from .attributes import IS_OF_THE_SCENE, Hook, absent_hook, attribute, constant

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from ._native import Config, Env
    from .spaces import Observation

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


IS_A_COPY = "it is a copy of the simulation: use reset() with options, set_state and settings"


class Simulated:
    """The reference's attributes of one simulation, and its methods that programs call."""

    _native: Env
    _config: Config
    _model: Any

    @attribute(IS_A_COPY)
    def model(self) -> Any:
        """The model as a ``mujoco.MjModel``, if the package ``mujoco`` is installed.

        It is compiled from the same scene, without what :attr:`variation` changes. Its arrays
        cannot be written to, because that would not change the environment: write to a copy
        (``copy.copy``), and pass settings when you make it.
        """
        if self._model is None:
            self._model = model_of(self._native)
        return self._model

    @attribute(IS_A_COPY)
    def data(self) -> Any:
        """The current state as a new ``mujoco.MjData``, separate from the environment.

        The positions and velocities are exact; derived quantities are recomputed with
        ``mj_forward``. Nothing in it can be assigned, because that would not change the
        environment: write to a copy (``copy.copy``), or use :meth:`reset` with options.
        """
        return data_of(self._native, self.model)

    @attribute(IS_OF_THE_SCENE)
    def initial_qpos(self) -> NDArray[np.float64]:
        """Positions of all joints in the settled scene."""
        return constant(self._native.simulation()["initial_qpos"])

    @attribute(IS_OF_THE_SCENE)
    def initial_qvel(self) -> NDArray[np.float64]:
        """Velocities of all joints in the settled scene."""
        return constant(self._native.simulation()["initial_qvel"])

    @attribute("it is a module")
    def _mujoco(self) -> Any:
        """The package ``mujoco``, if it is installed."""
        return importlib.import_module("mujoco")

    @attribute("it is a module")
    def _utils(self) -> Any:
        """The reference's functions of ``model`` and ``data``, if it is installed.

        Those that write raise an error, because the two are copies.
        """
        return importlib.import_module("gymnasium_robotics.utils.mujoco_utils")

    @attribute(IS_A_COPY)
    def _model_names(self) -> Any:
        """The reference's names of the model's parts, if it is installed."""
        return self._utils.MujocoModelNames(self.model)

    @Hook
    def _sample_goal(self) -> Callable[[], NDArray[np.float64]]:
        """Draw a goal from the environment's random numbers, without changing the episode's."""
        return self._native.sample_goal

    @Hook
    def _get_obs(self) -> Callable[[], Observation]:
        """Return the current observation."""
        return self._native.observe

    @Hook
    def _is_success(self) -> Callable[[ArrayLike, ArrayLike], Any]:
        """Return 1.0 where goals are within the threshold of each other, and 0.0 elsewhere."""
        config = self._config
        return lambda achieved_goal, desired_goal: np.asarray(
            config.is_success(achieved_goal, desired_goal), np.float32
        )[()]

    @Hook
    def _get_gripper_xpos(self) -> Callable[[], NDArray[np.float64]]:
        """Return the position of the gripper's body, in meters."""
        return lambda: self.data.body("robot0:gripper_link").xpos

    generate_mujoco_observations = absent_hook("use the parts of the observation")
    _env_setup = absent_hook("make the environment with a model of your own")
    _initialize_simulation = absent_hook("make another environment")
    _mujoco_step = absent_hook("use step()")
    _render_callback = absent_hook("use render()")
    _reset_sim = absent_hook("use reset()")
    _set_action = absent_hook("use step()")
    _step_callback = absent_hook("use step()")


def model_of(native: Env) -> Any:
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


def data_of(native: Env, model: Any) -> Any:
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
