"""The seeds of draws."""

from __future__ import annotations

import os

import numpy as np


class Seeds:
    """A sequence of seeds, which copies continue."""

    def __init__(self, seed: int | None) -> None:
        """Begin it with a seed, or anywhere."""
        self._is_fixed = seed is not None
        self._generator = np.random.default_rng(seed)
        self._process = os.getpid()

    def draw(self) -> int:
        """Return the next seed."""
        if self._process != os.getpid():
            # Parent and child must not draw the same batches by accident.
            fresh = self._generator if self._is_fixed else np.random.default_rng()
            self._generator, self._process = fresh, os.getpid()
        return int(self._generator.integers(2**63))

    def __getstate__(self) -> tuple[bool, np.random.Generator]:
        """Return what copying keeps."""
        return self._is_fixed, self._generator

    def __setstate__(self, state: tuple[bool, np.random.Generator]) -> None:
        """Continue the sequence in this process."""
        self._is_fixed, self._generator = state
        self._process = os.getpid()
