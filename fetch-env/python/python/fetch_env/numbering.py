"""Numbers of steps, by which a replay buffer notices what it has not seen of an environment."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from .spaces import Observation

#: Where the info of a step has its number.
KEY = "fetch_env.step"

#: The episode, the step in it, from 1 on, and the first observation of the episode with its first
#: step, if it is known.
StepNumber: TypeAlias = "tuple[int, int, Observation | None]"

#: The episode and the step that come next if nothing else uses an environment.
Next: TypeAlias = "tuple[int, int]"


class StepNumbers:
    """The number of the next step of an environment."""

    def __init__(self) -> None:
        """Begin far from the numbers of other environments, also of other processes."""
        self._episode = int.from_bytes(os.urandom(6), "little") << 16
        self._step = 0
        self._start: Observation | None = None

    def begin(self, observation: Observation) -> None:
        """Count an episode."""
        self._episode += 1
        self._step = 0
        self._start = {part: numbers.copy() for part, numbers in observation.items()}

    def lose(self) -> None:
        """Count an episode of which nothing is known: it does not follow the last one."""
        self._episode += 2
        self._step = 0
        self._start = None

    def count(self, info: dict[str, Any]) -> None:
        """Count a step, and tell its info the number."""
        self._step += 1
        info[KEY] = (self._episode, self._step, self._start)
        self._start = None


def begins_at(
    number: StepNumber, expected: Next | None, observations: Observation, env_index: int
) -> bool:
    """Tell whether a step was taken where a buffer believes.

    Args:
        number: The step's number.
        expected: What follows the last step that the buffer has seen.
        observations: Where the buffer believes that the steps were taken, a row for each.
        env_index: The row.

    Raises:
        ValueError: If one action took several steps.
    """
    episode, step, start = number
    if (episode, step) == expected:
        return True
    if expected is not None and episode == expected[0] and step > expected[1] > 1:
        message = (
            f"the environment took {step - expected[1] + 1} steps, and the buffer was told of one: "
            "use no wrapper that repeats actions, and another environment for other steps"
        )
        raise ValueError(message)
    return start is not None and all(
        np.array_equal(numbers, observations[part][env_index]) for part, numbers in start.items()
    )


def next_of(number: StepNumber, *, done: bool) -> Next:
    """Return what follows a step: the next one, or the first of the next episode."""
    episode, step, _ = number
    return (episode + 1, 1) if done else (episode, step + 1)
