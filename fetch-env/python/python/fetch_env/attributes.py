"""The attributes of the reference's environments: what can be read, and what can be assigned."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, Literal, NoReturn, TypeVar, overload

import numpy as np
from gymnasium.error import ClosedEnvironmentError

from .rewards import GoalRewards

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray
    from typing_extensions import Self

    from ._native import Env, VecEnv

T = TypeVar("T")

#: Where the reference has a range, which it does not use, although there is no object.
REACH_OBJ_RANGE = 0.15


class Attribute(Generic[T]):
    """An attribute that is read like a property, and whose assignment raises what to do instead.

    Where the environment does not have it, such as when it is closed, ``hasattr`` is false.
    """

    def __init__(self, read: Callable[[Any], T], remedy: str) -> None:
        """Read the attribute with a function."""
        self._read = read
        self._remedy = remedy
        self.__doc__ = read.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        """Learn the name."""
        self._name = name

    @overload
    def __get__(self, env: None, owner: type) -> Self: ...
    @overload
    def __get__(self, env: object, owner: type) -> T: ...
    def __get__(self, env: object | None, owner: type) -> Self | T:
        """Read the attribute."""
        if env is None:
            return self
        try:
            return self._read(env)
        except (AttributeError, ClosedEnvironmentError, ImportError) as error:
            message = f"{self._name}: {error}"
            raise AttributeError(message) from error

    def __set__(self, env: object, value: Any) -> None:
        """Refuse the value."""
        message = f"{self._name} cannot be assigned: {self._remedy}"
        raise AttributeError(message)


class Setting(Attribute[T]):
    """A setting that can be assigned, unless the environments are a vector."""

    def __set__(self, env: Any, value: T) -> None:
        """Change the setting from now on."""
        env._change(self._name, value)  # noqa: SLF001


def attribute(remedy: str) -> Callable[[Callable[[Any], T]], Attribute[T]]:
    """Make an attribute that cannot be assigned of the method that reads it."""
    return lambda read: Attribute(read, remedy)


def setting(read: Callable[[Any], T]) -> Setting[T]:
    """Make a setting of the method that reads it."""
    return Setting(read, "")


def absent(remedy: str) -> Attribute[NoReturn]:
    """Make an attribute of the reference that is neither read nor assigned here."""
    return Attribute(_refusal(remedy), remedy)


class Hook(Attribute[T]):
    """A method that the reference calls on itself, and that programs replace there."""

    def __init__(self, read: Callable[[Any], T]) -> None:
        """Return the method with a function."""
        super().__init__(read, IS_NEVER_CALLED)


def absent_hook(remedy: str) -> Hook[NoReturn]:
    """Make such a method that cannot be called either."""
    return Hook(_refusal(remedy))


def _refusal(remedy: str) -> Callable[[object], NoReturn]:
    def read(_env: object) -> NoReturn:
        raise AttributeError(remedy)

    return read


def constant(numbers: Any) -> NDArray[np.float64]:
    """Return numbers as an array that refuses to be written to."""
    array = np.asarray(numbers, np.float64)
    array.flags.writeable = False
    return array


IS_NEVER_CALLED = (
    "the environment never calls it: pass settings, options to reset(), or wrap the environment"
)
IS_MADE_WITH_IT = "pass it when you make the environment"
IS_OF_THE_TASK = "it belongs to the task"
IS_OF_THE_SCENE = "it follows from the scene: make the environment with a model of your own"
HAS_NO_SIMULATION = (
    "the simulation is not a Python object: use get_state, set_state, data and model"
)


class Attributes(GoalRewards):
    """What one environment and a vector have in common of the reference's attributes.

    Settings of the reward count from the assignment on, and those of what is drawn from the next
    reset on, as in the reference. A replay buffer that was made before takes no more steps then.
    """

    _native: Env | VecEnv

    def _change(self, name: str, value: Any) -> None:
        raise NotImplementedError

    @setting
    def distance_threshold(self) -> float:
        """Distance within which a goal counts as reached, in meters."""
        return self._config.distance_threshold

    @setting
    def reward_type(self) -> Literal["sparse", "dense"]:
        """``"sparse"`` or ``"dense"``."""
        return self._config.reward_type

    @setting
    def obj_range(self) -> float:
        """Largest distance of the object's start from the gripper in x and y, in meters."""
        meters = self._config.object_range
        return REACH_OBJ_RANGE if meters is None else meters

    @setting
    def target_range(self) -> float:
        """Largest distance of a goal along each axis, in meters."""
        return self._config.target_range

    @setting
    def target_offset(self) -> Any:
        """Offset of every goal along x, y, z, in meters. Assign three numbers, or one for all."""
        return constant(self._config.target_offset)

    @setting
    def target_in_the_air(self) -> bool:
        """Whether goals are in the air, half of them with an object, and all without."""
        return self._config.target_in_the_air or not self._config.has_object

    @attribute(IS_MADE_WITH_IT)
    def n_substeps(self) -> int:
        """Physics steps of 2 ms in a control step."""
        return self._config.n_substeps

    @attribute("pass n_substeps when you make the environment")
    def dt(self) -> float:
        """Duration of a control step, in seconds."""
        return self._config.control_period

    @attribute(IS_OF_THE_TASK)
    def has_object(self) -> bool:
        """Whether the task has an object."""
        return self._config.has_object

    @attribute(IS_OF_THE_TASK)
    def block_gripper(self) -> bool:
        """Whether the fingers are held closed."""
        return self._config.block_gripper

    @attribute(IS_OF_THE_TASK)
    def gripper_extra_height(self) -> float:
        """Height that is added to the gripper's start, in meters."""
        return self._config.gripper_extra_height

    @attribute(IS_OF_THE_SCENE)
    def initial_gripper_xpos(self) -> NDArray[np.float64]:
        """Where the gripper starts, as x, y, z in meters."""
        return constant(self._native.settled()[0])

    @attribute(IS_OF_THE_SCENE)
    def height_offset(self) -> float:
        """Height of the object's center at the start, in meters; only with an object."""
        height = self._native.settled()[1]
        if height is None:
            message = "there is no object"
            raise AttributeError(message)
        return height

    object_range = absent("assign obj_range, the reference's name")
    max_episode_steps = absent("pass it to gymnasium.make, or use gymnasium.wrappers.TimeLimit")
    sim = absent(HAS_NO_SIMULATION)
    viewer = absent(HAS_NO_SIMULATION)
    initial_time = absent(HAS_NO_SIMULATION)
