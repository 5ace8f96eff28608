"""Goal-conditioned environments of other packages, as replay buffers take them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import gymnasium
from gymnasium import spaces

from . import _native
from .rewards import REWARD_WRAPPERS, layers, refuse_own_rewards
from .spaces import PARTS

if TYPE_CHECKING:
    from .rewards import Reward
    from .settings import ConfigArguments

#: The name of an environment, and the lengths of its observations, goals and actions.
OtherKind: TypeAlias = tuple[str, int, int, int]


def native_kind(kind: ConfigArguments | OtherKind) -> _native.Config | OtherKind:
    """Return what the native buffer takes."""
    return kind if isinstance(kind, tuple) else _native.Config(**kind)


def other_kind(env: Any) -> OtherKind:
    """Describe an environment, or a vector of one kind.

    Raises:
        TypeError: If it is not goal-conditioned, or its parts are no vectors of numbers.
    """
    is_single = isinstance(env, gymnasium.Env)
    name = str(env.spec.id if getattr(env, "spec", None) else type(env.unwrapped).__name__)
    space = env.observation_space if is_single else env.single_observation_space
    action_space = env.action_space if is_single else env.single_action_space
    if not isinstance(space, spaces.Dict) or not set(PARTS) <= set(space):
        message = f"{name} is not goal-conditioned: its observations lack {', '.join(PARTS)}"
        raise TypeError(message)
    shapes = []
    for part, box in (*((part, space[part]) for part in PARTS), ("action", action_space)):
        if not isinstance(box, spaces.Box) or len(box.shape) != 1:
            message = f"{part} of {name} is in {box}: the buffer stores vectors, of a Box (N,)"
            raise TypeError(message)
        shapes.append(box.shape)
    (observation,), goal, desired, (action,) = shapes
    if goal != desired:
        message = f"the goals of {name} have the shapes {goal} and {desired}: they must be the same"
        raise TypeError(message)
    return name, observation, goal[0], action


def reward_of(env: Any) -> Reward:
    """Return the environment's function of achieved goals, desired goals and infos.

    Raises:
        ValueError: If it is in another process, or a wrapper changes rewards without one.
    """
    for layer in layers(env):
        if isinstance(layer, REWARD_WRAPPERS):
            refuse_own_rewards(type(layer).__name__)
    function: Reward | None = method_of(env, "compute_reward")
    if function is None:
        message = (
            f"{type(env.unwrapped).__name__} has no compute_reward here: pass reward=, a function "
            "of achieved goals, desired goals and infos that computes a whole batch"
        )
        raise ValueError(message)
    return function


def method_of(env: Any, name: str) -> Any:
    """Return a method of an environment, or of the first of a vector in this process."""
    if not isinstance(env, gymnasium.Env):
        env = next(iter(getattr(env.unwrapped, "envs", ())), None)
    return env.get_wrapper_attr(name) if env is not None and env.has_wrapper_attr(name) else None
