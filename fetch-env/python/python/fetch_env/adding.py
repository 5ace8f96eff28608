"""Adding steps and episodes to a replay buffer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .recorded import recorded_vector
from .spaces import parts

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gymnasium.vector import VectorEnv
    from numpy.typing import ArrayLike

    from . import _native
    from .spaces import Observation


class Adding:
    """What fills a :class:`fetch_env.HerBuffer`."""

    _native: _native.Buffer

    def _check_env(self) -> None:
        """Raise an error if the environment has other rewards by now."""
        raise NotImplementedError

    def record(
        self, envs: VectorEnv[Any, Any, Any], *, fields: Mapping[str, ArrayLike] | None = None
    ) -> None:
        """Store what a vector's last ``reset``, ``step``, ``step_wait`` or ``set_state`` returned.

        Call it after each of them, including the first reset. It works in every autoreset mode.
        Steps before a reset need not be recorded: the episode before ends with the steps it has.

        Args:
            envs: A :class:`fetch_env.FetchVectorEnv`. Wrappers of Gymnasium that only look may be
                around it: ``RecordEpisodeStatistics``, ``RecordVideo``, ``HumanRendering`` and
                ``DictInfoToList``.
            fields: For each of the buffer's fields, an array of shape (num_envs, length), or
                (num_envs,) for the length 1; not needed for a reset.

        Raises:
            ValueError: If the environments have transitions of another kind (see the class), if
                this was recorded before, if results before it were not recorded, or if
                it belongs to another episode than the one under way: that of other environments, of
                a copy, or one that was loaded or begun by hand. Nothing is stored then; go on with
                :meth:`resume`, or with a reset that is recorded.
            TypeError: If a wrapper may change what the vector takes and returns, or a vector is
                another one, such as Gymnasium's ``SyncVectorEnv``.
        """
        self._native.record(recorded_vector(envs)._native, fields)  # noqa: SLF001

    def resume(self, envs: VectorEnv[Any, Any, Any]) -> None:
        """Go on recording from the states in which a vector is, in the middle of episodes as well.

        Call it in place of :meth:`record` where that raises an error, after :meth:`load`, and for a
        vector that was copied or whose state was set. Where an episode under way is in the state
        that the vector shows, it goes on; any other ends with the steps it has, and one begins in
        this state.
        """
        self._native.resume(recorded_vector(envs)._native)  # noqa: SLF001

    def begin_episode(self, observation: Observation, *, env_index: int = 0) -> None:
        """Begin an episode of one environment with its first observation.

        Raises:
            ValueError: If an episode is under way, a number is not finite, or the environment with
                which the buffer was made has another reward by now.
        """
        self._check_env()
        self._native.begin_episode(
            env_index,
            *parts(observation),
        )

    def add_step(  # noqa: PLR0913
        self,
        action: ArrayLike,
        observation: Observation,
        reward: float,
        *,
        terminated: bool,
        truncated: bool,
        fields: Mapping[str, ArrayLike] | None = None,
        env_index: int = 0,
    ) -> None:
        """Add what a step of one environment returned to the episode that was begun.

        The episode is stored when it ends: by its last step, by :meth:`end_episode`, or before a
        step whose observation has another goal. That begins another. ``fields`` has an array of
        shape (length,), or a number for the length 1, for each of the buffer's.

        Raises:
            ValueError: If no episode is under way, a number is not finite, or the environment with
                which the buffer was made has another reward by now.
        """
        self._check_env()
        observed, achieved_goal, desired_goal = parts(observation)
        self._native.add_step(
            env_index,
            action,
            observed,
            achieved_goal,
            desired_goal,
            reward,
            terminated,
            truncated,
            fields,
        )

    def end_episode(self, *, env_index: int = 0) -> None:
        """End the episode that is under way, as if it were truncated."""
        self._native.end_episode(env_index)

    def discard_episode(self, *, env_index: int = 0) -> None:
        """Forget the episode that is under way."""
        self._native.discard_episode(env_index)

    def unfinished_steps(self, *, env_index: int = 0) -> int | None:
        """Return the number of steps of the episode under way; ``None`` if there is none."""
        return self._native.unfinished_steps(env_index)

    def add_episode(  # noqa: PLR0913
        self,
        *,
        observation: ArrayLike,
        achieved_goal: ArrayLike,
        desired_goal: ArrayLike,
        action: ArrayLike,
        reward: ArrayLike,
        terminated: bool = False,
        truncated: bool = True,
        fields: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Add a whole episode of T steps.

        Args:
            observation: Of shape (T + 1, length): 10 or 25 for Fetch.
            achieved_goal: Of shape (T + 1, length): for Fetch 3, in meters.
            desired_goal: Of shape (length,).
            action: Of shape (T, length): 4 for Fetch.
            reward: Of shape (T,).
            terminated: Whether the last step ended the task.
            truncated: Whether the last step cut the episode off.
            fields: For each of the buffer's fields, an array of shape (T, length), or (T,) for the
                length 1.
        """
        self._native.add_episode(
            observation, achieved_goal, desired_goal, action, reward, terminated, truncated, fields
        )
