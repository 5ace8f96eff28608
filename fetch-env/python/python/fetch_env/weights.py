"""Policies as arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Weights(TypedDict):
    """A policy as numpy arrays; see :meth:`fetch_env.Policy.weights`."""

    inputs: list[str]
    """What the network gets, one after the other: ``"observation"``, ``"achieved_goal"``,
    ``"desired_goal"``, or ``"relative_goal"``, the desired goal minus the achieved one."""
    mean: NDArray[np.float64]
    std: NDArray[np.float64]
    clip: NDArray[np.float64]
    """The largest normalized element of each input."""
    layers: list[tuple[NDArray[np.float32], NDArray[np.float32]]]
    """Weights of shape (inputs, outputs), and biases."""
