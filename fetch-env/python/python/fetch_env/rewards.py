"""Rewards of any pairs of goals, for one and for many environments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import gymnasium

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from . import _native
    from .settings import ConfigArguments, Settings


#: Called with the achieved goals, the desired goals and the infos of a whole batch: arrays of shape
#: (N, 3), and a list of N empty dictionaries. Returns N rewards.
Reward: TypeAlias = "Callable[[Any, Any, Any], ArrayLike]"

#: The same, but returns whether each of the N steps ends the task.
Terminated: TypeAlias = Reward

#: The attribute of Gymnasium's ``TimeLimit``, and of vectors.
TIME_LIMIT = "_max_episode_steps"

#: Wrappers of Gymnasium that change rewards without a ``compute_reward``.
REWARD_WRAPPERS = (
    gymnasium.RewardWrapper,
    gymnasium.vector.VectorRewardWrapper,
    gymnasium.wrappers.NormalizeReward,
    gymnasium.wrappers.vector.NormalizeReward,
)


class _ChangesRewards(type):
    def __instancecheck__(cls, wrapper: object) -> bool:
        # Some wrappers forward what they do not have to the environment.
        method = getattr(wrapper, "compute_reward", None)
        is_own = method is not None and getattr(method, "__func__", None) is not _COMPUTE_REWARD
        return is_own or isinstance(wrapper, REWARD_WRAPPERS)


class ChangesRewards(metaclass=_ChangesRewards):
    """A wrapper with rewards of its own, as ``isinstance`` tells in any process."""


def own_rewards(env: Any) -> str | None:
    """Name what gives an environment, or a vector, other rewards than its settings."""
    *wrappers, inner = layers(env)
    changing = (
        type(wrapper).__name__ for wrapper in wrappers if isinstance(wrapper, ChangesRewards)
    )
    return next(changing, None) or inner.own_rewards()


def episode_len(env: Any) -> int | None:
    """Return the number of steps after which episodes are cut off; ``None`` without a limit."""
    limits = (getattr(layer, TIME_LIMIT, None) for layer in layers(env))
    return min((steps for steps in limits if steps is not None), default=None)


def layers(env: Any) -> Iterator[Any]:
    """Return the wrappers around an environment or a vector, from the outside, and it itself."""
    while env is not env.unwrapped:
        yield env
        env = env.env
    yield env


def check_function(name: str, function: object) -> None:
    """Raise an error if an argument is given that is not a function."""
    if function is not None and not callable(function):
        message = f"{name} is {type(function).__name__}: pass a function"
        raise TypeError(message)


def refuse_own_rewards(name: str | None) -> None:
    """Raise an error if an environment has other rewards than its settings.

    Relabeling computes the rewards of the settings, and would not notice.
    """
    if name is not None:
        message = (
            f"{name} has rewards of its own, and the buffer would relabel with those of the "
            "settings: pass reward=, a function of achieved goals, desired goals and infos that "
            "computes a whole batch, such as the environment's compute_reward"
        )
        raise ValueError(message)


class GoalRewards:
    """Functions of the goals alone, computed in Rust."""

    _config: _native.Config
    _env_id: str
    _settings: Settings

    def config_arguments(self) -> ConfigArguments:
        """Return the arguments from which the settings can be made again."""
        return {"env_id": self._env_id, **self._settings}

    def own_rewards(self) -> str | None:
        """Name the class if ``compute_reward`` is not the package's; for replay buffers."""
        method = self.compute_reward
        is_ours = (
            getattr(method, "__func__", None) is _COMPUTE_REWARD
            and getattr(method, "__self__", None) is self
        )
        return None if is_ours else type(self).__name__

    def compute_reward(
        self,
        achieved_goal: ArrayLike,
        desired_goal: ArrayLike | None = None,
        info: object = None,
        *,
        goal: ArrayLike | None = None,
    ) -> float | NDArray[np.floating[Any]]:
        """Compute the reward of a step with these goals, as hindsight relabeling needs it.

        Args:
            achieved_goal: Goals of shape (..., 3), in meters; (..., goal_len) in a task of your
                own.
            desired_goal: Goals of the same shape.
            info: Not used.
            goal: The reference's keyword for ``desired_goal``: pass one of the two.

        Returns:
            A float for one pair, and an array of shape (...) for several, of ``float32`` if rewards
            are sparse or both goals are ``float32``, and otherwise of ``float64``.
        """
        del info
        if desired_goal is None:
            desired_goal, goal = goal, None
        if desired_goal is None or goal is not None:
            message = "pass either desired_goal or, as in the reference, goal"
            raise TypeError(message)
        return self._config.compute_reward(achieved_goal, desired_goal)

    def compute_terminated(
        self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: object = None
    ) -> bool | NDArray[np.bool_]:
        """Tell whether steps with these goals would end the task: never."""
        del info
        return self._config.compute_terminated(achieved_goal, desired_goal)

    def compute_truncated(
        self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: object = None
    ) -> bool | NDArray[np.bool_]:
        """Tell whether steps with these goals would cut the episode off: never."""
        del info
        return self._config.compute_truncated(achieved_goal, desired_goal)


#: The function with which relabeled rewards agree, whatever replaces it later.
_COMPUTE_REWARD = GoalRewards.compute_reward
