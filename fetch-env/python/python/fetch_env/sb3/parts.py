"""How the parts of observations become the columns of a replay buffer, and again parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.preprocessing import is_image_space

from fetch_env.spaces import PARTS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    Columns: TypeAlias = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]


class Parts:
    """The parts of an observation. Those that are no goals share the column ``observation``."""

    def __init__(self, space: spaces.Space[Any]) -> None:
        """Check that the buffer can store all parts.

        Raises:
            TypeError: If it cannot.
        """
        theirs = "use Stable-Baselines3's HerReplayBuffer"
        if not isinstance(space, spaces.Dict) or not set(PARTS) <= set(space):
            message = f"the observations are not dictionaries of {', '.join(PARTS)}: {theirs}"
            raise TypeError(message)
        for key, part in space.items():
            is_vector = isinstance(part, (spaces.Box, spaces.MultiBinary))
            if not is_vector or is_image_space(part):
                message = f"{key} is in {part}, and this buffer stores vectors, no images: {theirs}"
                raise TypeError(message)
        self._shapes = {key: tuple(part.shape or ()) for key, part in space.items()}
        self._joined = ["observation", *(key for key in space if key not in PARTS)]

    def lengths(self) -> tuple[int, int]:
        """Return the lengths of the column ``observation`` and of a goal."""
        joined = sum(self._length(key) for key in self._joined)
        return joined, self._length("achieved_goal")

    def _length(self, key: str) -> int:
        return int(np.prod(self._shapes[key]))

    def columns(self, observations: Mapping[str, NDArray[Any]]) -> Columns:
        """Return the columns ``observation``, ``achieved_goal`` and ``desired_goal``."""
        rows = {key: part.reshape(len(part), -1) for key, part in observations.items()}
        joined = np.concatenate([rows[key] for key in self._joined], axis=1)
        return joined, rows["achieved_goal"], rows["desired_goal"]

    def of(self, *columns: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
        """Return the parts that columns hold."""
        joined, achieved_goal, desired_goal = columns
        ends = np.cumsum([self._length(key) for key in self._joined])[:-1]
        parts = dict(zip(self._joined, np.split(joined, ends, axis=1), strict=True))
        parts |= {"achieved_goal": achieved_goal, "desired_goal": desired_goal}
        return {key: part.reshape(-1, *self._shapes[key]) for key, part in parts.items()}
