"""What acts: trained policies, functions, and models of other packages."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from numpy.typing import ArrayLike

from .policy import Policy

if TYPE_CHECKING:
    from . import _native

#: A function of an observation that returns its action, or of many that returns one for each.
Act: TypeAlias = Callable[[dict[str, Any]], ArrayLike]


class Model(Protocol):
    """A model as Stable-Baselines3 has it."""

    def predict(self, observation: Any, *, deterministic: bool) -> tuple[Any, Any]:
        """Return the actions of many observations, and a state."""


def acting(policy: Policy | Model | Act, *, batched: bool) -> tuple[_native.Policy | Act, bool]:
    """Return what the native module takes, and whether that takes many observations at once.

    Raises:
        TypeError: If it is none of the three.
    """
    if isinstance(policy, Policy):
        return policy._native, True  # noqa: SLF001
    predict = getattr(policy, "predict", None)
    if predict is not None:
        return lambda observation: predict(observation, deterministic=True)[0], True
    if not callable(policy):
        message = (
            f"the policy is {type(policy).__name__}: pass a fetch_env.Policy, a function of "
            "observations, or a model with predict()"
        )
        raise TypeError(message)
    return policy, batched
