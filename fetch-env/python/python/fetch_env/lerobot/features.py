"""What LeRobot's policies see of a Fetch task, and what they are told to do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fetch_env.spaces import Observation

#: What to do, by the name of the task.
INSTRUCTIONS = {
    "Reach": "Move the gripper to the red target.",
    "Push": "Push the block to the red target.",
    "PickAndPlace": "Pick up the block and move it to the red target.",
    "Slide": "Hit the puck so that it slides to the red target.",
}

#: The robot's numbers.
STATE = (
    *(f"gripper_{axis}" for axis in "xyz"),
    *(f"{side}_finger" for side in ("right", "left")),
    *(f"gripper_velocity_{axis}" for axis in "xyz"),
    *(f"{side}_finger_velocity" for side in ("right", "left")),
)
#: The object's numbers.
OBJECT = (
    *(f"object_{axis}" for axis in "xyz"),
    *(f"object_from_gripper_{axis}" for axis in "xyz"),
    *(f"object_angle_{axis}" for axis in "xyz"),
    *(f"object_velocity_{axis}" for axis in "xyz"),
    *(f"object_angular_velocity_{axis}" for axis in "xyz"),
)
GOAL = tuple(f"goal_{axis}" for axis in "xyz")
ACTION = ("dx", "dy", "dz", "fingers")

#: Where the robot's numbers are in an observation with an object; the others are the object's.
_IS_STATE = np.isin(np.arange(len(STATE) + len(OBJECT)), [0, 1, 2, 9, 10, *range(20, 25)])


def instruction(env_id: str) -> str:
    """Return what to do in an environment."""
    task = env_id.rpartition("/")[2].removeprefix("Fetch").removesuffix("-v4")
    return INSTRUCTIONS[task.removesuffix("Dense")]


def environment_state(*, has_object: bool) -> tuple[str, ...]:
    """Return the names of the numbers of ``observation.environment_state``."""
    return (*OBJECT, *GOAL) if has_object else GOAL


def split(observation: Observation) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the robot's numbers, and those of its environment."""
    numbers, goal = observation["observation"], observation["desired_goal"]
    is_state = _IS_STATE if len(numbers) == len(_IS_STATE) else np.ones(len(numbers), bool)
    state, rest = numbers[is_state], np.concatenate([numbers[~is_state], goal])
    return state.astype(np.float32), rest.astype(np.float32)


def numbers(names: tuple[str, ...], dtype: str = "float32") -> dict[str, Any]:
    """Return the description of a column of a data set."""
    return {"dtype": dtype, "shape": (len(names),), "names": list(names)}
