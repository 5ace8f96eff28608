"""Trained policies."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from . import _native
from .spaces import parts

if TYPE_CHECKING:
    import os

    import numpy as np
    from numpy.typing import NDArray

    from .env import Observation


class Policy:
    """A trained policy: a small network that returns the greedy action for an observation.

    ``policy(observation)`` returns an action of ``float32`` from -1 to 1, of shape (4,), or of
    shape (..., 4) for a batch of observations of any shape::

        policy = fetch_env.Policy.shipped("FetchPush-v4")
        action = policy(observation)
    """

    def __init__(self, native: _native.Policy) -> None:
        """Wrap a policy that was loaded or trained."""
        self._native = native

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Policy:
        """Load a file that :meth:`save` or ``fetch-env train`` wrote.

        Raises:
            OSError: If the file cannot be read.
            ValueError: If it holds no policy.
        """
        return cls(_native.Policy.load(path))

    @classmethod
    def shipped(cls, env_id: str) -> Policy:
        """Return the policy that comes with the package for an environment's task."""
        return cls(_native.Policy.shipped(env_id))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the policy to a safetensors file.

        A file that is there is replaced whole, or stays as it is.

        Raises:
            OSError: If the file cannot be written.
        """
        self._native.save(path)

    @property
    def header(self) -> dict[str, Any]:
        """How the policy was trained, and how often it succeeds if that was measured."""
        header: dict[str, Any] = json.loads(self._native.header())
        return header

    def __call__(self, observation: Observation) -> NDArray[np.float32]:
        """Return the greedy action; see the class.

        Raises:
            TypeError: If the observation is not a dictionary of ``observation``,
                ``achieved_goal`` and ``desired_goal``.
            ValueError: If their shapes do not fit the policy or each other, or a number is NaN or
                infinite.
        """
        return self._native.act(*parts(observation))

    def predict(
        self,
        observation: Observation,
        state: object = None,
        episode_start: object = None,
        deterministic: bool = True,  # noqa: FBT001, FBT002
    ) -> tuple[NDArray[np.float32], None]:
        """Return the greedy action as a policy of Stable-Baselines3 does."""
        del state, episode_start, deterministic
        return self(observation), None

    def __getstate__(self) -> bytes:
        """Return what pickling and copying keep: a file's contents."""
        return self._native.to_bytes()

    def __setstate__(self, state: bytes) -> None:
        """Load the policy."""
        self._native = _native.Policy(state)
