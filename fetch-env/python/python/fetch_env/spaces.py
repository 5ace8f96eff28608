"""The spaces of the environments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import gymnasium
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from ._native import Config

#: ``observation`` (10 numbers in Reach, 25 elsewhere), ``achieved_goal`` and ``desired_goal``
#: (x, y, z in meters), all ``float64``.
Observation: TypeAlias = "dict[str, NDArray[np.float64]]"

#: dx, dy, dz, fingers.
ACTION_LEN = 4

#: The parts of an observation, in the order in which the native module takes them.
PARTS = ("observation", "achieved_goal", "desired_goal")


def parts(observation: Mapping[str, Any]) -> list[Any]:
    """Return the parts of an observation."""
    try:
        return [observation[part] for part in PARTS]
    except (KeyError, IndexError, TypeError):
        message = "an observation is a dictionary of observation, achieved_goal and desired_goal"
        raise TypeError(message) from None


def action_space() -> gymnasium.spaces.Box:
    """Return the space of actions: dx, dy, dz, fingers, each from -1 to 1."""
    return gymnasium.spaces.Box(-1.0, 1.0, (ACTION_LEN,), np.float32)


def observation_space(config: Config) -> gymnasium.spaces.Dict:
    """Return the space of observations: the three unbounded parts."""

    def part(length: int) -> gymnasium.spaces.Box:
        return gymnasium.spaces.Box(-np.inf, np.inf, (length,), np.float64)

    return gymnasium.spaces.Dict(
        {
            "achieved_goal": part(config.goal_len),
            "desired_goal": part(config.goal_len),
            "observation": part(config.observation_len),
        }
    )
