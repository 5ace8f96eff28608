"""Which vectors of environments a replay buffer can record."""

from __future__ import annotations

from typing import Any

import gymnasium
from gymnasium.vector import VectorWrapper

from .vector import FetchVectorEnv

#: Wrappers that change neither actions nor observations, rewards and ends of episodes. A subclass
#: of one may. ``RecordVideo`` came with Gymnasium 1.2.
UNCHANGING = frozenset(
    (
        VectorWrapper,
        gymnasium.wrappers.vector.DictInfoToList,
        gymnasium.wrappers.vector.HumanRendering,
        gymnasium.wrappers.vector.RecordEpisodeStatistics,
        getattr(gymnasium.wrappers.vector, "RecordVideo", VectorWrapper),
    )
)

#: What returns the results that are recorded.
CALLS = frozenset(("reset", "set_state", "step", "step_async", "step_wait"))


def returns_its_own(envs: FetchVectorEnv) -> bool:
    """Tell whether neither a subclass nor an attribute replaces what returns the results."""
    kind = type(envs)
    own = kind is FetchVectorEnv or all(
        getattr(kind, name) is getattr(FetchVectorEnv, name) for name in CALLS
    )
    return own and CALLS.isdisjoint(vars(envs))


def recorded_vector(envs: object) -> FetchVectorEnv:
    """Return the vector whose own results ``envs`` returns.

    Raises:
        TypeError: If something between may change them, or there is no such vector.
    """
    inner: Any = envs
    while type(inner) in UNCHANGING and CALLS.isdisjoint(vars(inner)):
        inner = inner.env
    if isinstance(inner, FetchVectorEnv) and returns_its_own(inner):
        return inner
    name = type(inner).__name__
    if isinstance(inner, (VectorWrapper, FetchVectorEnv)):
        within = "FetchVectorEnv" if isinstance(inner, FetchVectorEnv) else "envs.unwrapped"
        message = (
            f"{name} may change what the environments take and return, and the buffer would not "
            f"see it: record {within}, if what that takes and returns is to be stored, or add what "
            f"{name} takes and returns with begin_episode() and add_step()"
        )
    else:
        message = (
            f"only a FetchVectorEnv can be recorded, and not {name}: add its steps with "
            "begin_episode() and add_step()"
        )
    raise TypeError(message)
