"""Rewards of any pairs of goals, for one and for many environments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .spaces import GOAL_LEN

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from . import _native
    from .settings import ConfigArguments, Settings


def check_rewards(config: _native.Config, compute_reward: Callable[..., Any]) -> None:
    """Raise an error if an environment's own function gives other rewards than its settings.

    Relabeling computes the rewards of the settings, and would not notice.
    """
    threshold = config.distance_threshold
    desired = np.zeros((4, GOAL_LEN))
    achieved = desired.copy()
    achieved[:, 0] = 0.0, 0.9 * threshold, 1.1 * threshold, threshold + 1.0
    expected = config.compute_reward(achieved, desired)
    rewards = compute_reward(achieved, desired, [{}] * len(desired))
    if not np.allclose(rewards, expected):
        message = (
            f"compute_reward of the environment returns {rewards}, and the buffer would relabel "
            f"with {expected}, the rewards of its settings: use a buffer that calls compute_reward"
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
            achieved_goal: Goals of shape (..., 3), in meters.
            desired_goal: Goals of the same shape.
            info: Not used.
            goal: The reference's keyword for ``desired_goal``: pass one of the two.

        Returns:
            A float for one pair, and an array of shape (...) for several: of ``float32`` if rewards
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
