"""The hindsight replay buffer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import gymnasium

from . import _native
from .recorded import recorded_vector
from .rewards import check_rewards

if TYPE_CHECKING:
    import os

    from gymnasium.vector import VectorEnv
    from numpy.typing import ArrayLike, NDArray

    from .env import Observation
    from .settings import ConfigArguments

GoalStrategy: TypeAlias = Literal["future", "final", "episode", "random"]


class HerBuffer:
    """A replay buffer that draws transitions with goals that were achieved later (hindsight).

    It stores ``float32``, and draws many times as fast as a buffer in Python. It records what each
    call of several environments returns::

        envs = fetch_env.FetchVectorEnv("FetchPush-v4", 16)
        buffer = fetch_env.HerBuffer(envs, capacity=1_000_000)
        envs.reset(seed=0)
        buffer.record(envs)
        for _ in range(100):
            envs.step(envs.action_space.sample())
            buffer.record(envs)
        batch = buffer.sample(256)

    Args:
        env: The environment, one or many, that determines lengths and rewards; wrappers may be
            around it.
        capacity: Number of transitions; the oldest episodes make room for new ones.

    Raises:
        ValueError: If a wrapper or a subclass has a ``compute_reward`` of its own, or the capacity
            is too small.
    """

    def __init__(
        self, env: gymnasium.Env[Any, Any] | VectorEnv[Any, Any, Any], capacity: int
    ) -> None:
        """Create an empty buffer; see the class."""
        inner: Any = env.unwrapped
        if isinstance(env, gymnasium.Env):
            num_envs, compute_reward = 1, env.get_wrapper_attr("compute_reward")
        else:
            num_envs, compute_reward = inner.num_envs, inner.compute_reward
        self._make: ConfigArguments = inner.config_arguments()
        config = _native.Config(**self._make)
        check_rewards(config, compute_reward)
        self._native = _native.Buffer(config, capacity, num_envs)
        self._draws = 0

    def __len__(self) -> int:
        """Return the number of transitions of finished episodes."""
        return len(self._native)

    @property
    def num_episodes(self) -> int:
        """Number of finished episodes."""
        return self._native.num_episodes

    @property
    def capacity(self) -> int:
        """Largest number of transitions."""
        return self._native.capacity

    def record(self, envs: VectorEnv[Any, Any, Any]) -> None:
        """Store what a vector's last ``reset``, ``step``, ``step_wait`` or ``set_state`` returned.

        Call it after each of them, including the first reset. It works in every autoreset mode.
        Steps before a reset need not be recorded: the episode before ends with the steps it has.

        Args:
            envs: A :class:`fetch_env.FetchVectorEnv`. Wrappers of Gymnasium that only look may be
                around it: ``RecordEpisodeStatistics``, ``RecordVideo``, ``HumanRendering`` and
                ``DictInfoToList``.

        Raises:
            ValueError: If this was recorded before, if results before it were not recorded, or if
                it belongs to another episode than the one under way: that of other environments, of
                a copy, or one that was loaded or begun by hand. Nothing is stored then; go on with
                :meth:`resume`, or with a reset that is recorded.
            TypeError: If a wrapper may change what the vector takes and returns, or a vector is
                another one, such as Gymnasium's ``SyncVectorEnv``.
        """
        self._native.record(recorded_vector(envs)._native)  # noqa: SLF001

    def resume(self, envs: VectorEnv[Any, Any, Any]) -> None:
        """Go on recording from the states in which a vector is, in the middle of episodes as well.

        Call it in place of :meth:`record` where that raises an error, after :meth:`load`, and for a
        vector that was copied or whose state was set. Where an episode under way is in the state
        that the vector shows, it goes on; any other ends with the steps it has, and one begins in
        this state.
        """
        self._native.resume(recorded_vector(envs)._native)  # noqa: SLF001

    def begin_episode(self, observation: Observation, *, env_index: int = 0) -> None:
        """Begin an episode of one environment with its first observation."""
        self._native.begin_episode(
            env_index,
            observation["observation"],
            observation["achieved_goal"],
            observation["desired_goal"],
        )

    def add_step(  # noqa: PLR0913
        self,
        action: ArrayLike,
        observation: Observation,
        reward: float,
        *,
        terminated: bool,
        truncated: bool,
        env_index: int = 0,
    ) -> None:
        """Add what a step of one environment returned to the episode that was begun.

        The episode is stored when it ends: by its last step, or by :meth:`end_episode`.
        """
        self._native.add_step(
            env_index,
            action,
            observation["observation"],
            observation["achieved_goal"],
            reward,
            terminated,
            truncated,
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
    ) -> None:
        """Add a whole episode of T steps.

        Args:
            observation: Of shape (T + 1, 10 or 25).
            achieved_goal: Of shape (T + 1, 3), in meters.
            desired_goal: Of shape (3,), in meters.
            action: Of shape (T, 4).
            reward: Of shape (T,).
            terminated: Whether the last step ended the task.
            truncated: Whether the last step cut the episode off.
        """
        self._native.add_episode(
            observation, achieved_goal, desired_goal, action, reward, terminated, truncated
        )

    def sample(
        self,
        batch_size: int,
        *,
        strategy: GoalStrategy = "future",
        k: float = 4.0,
        seed: int | None = None,
    ) -> dict[str, NDArray[Any]]:
        """Draw a batch.

        Args:
            batch_size: Number of transitions.
            strategy: Where the new goals come from: from later in the episode, its end, anywhere in
                it, or any episode.
            k: Ratio of relabelled to original transitions: on average, ``k`` of every ``k + 1`` get
                a new goal.
            seed: Draws the same batch from the same contents. Without a seed, each call draws anew.

        Returns:
            New arrays with a row for each transition, which ``torch.from_numpy`` takes without a
            copy: ``observation``, ``achieved_goal``, ``desired_goal``, ``action``,
            ``next_observation``, ``next_achieved_goal`` and ``reward`` of ``float32``;
            ``terminated``, ``truncated`` and ``relabeled`` (whether the goal is new) of ``bool``.
        """
        if not 0.0 <= k < math.inf:
            message = f"k is {k}: pass a number from 0 on"
            raise ValueError(message)
        if seed is None:
            seed, self._draws = self._draws, self._draws + 1
        return self._native.sample(batch_size, strategy, k / (k + 1.0), seed)

    def clear(self) -> None:
        """Remove all transitions."""
        self._native.clear()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write all episodes to a file, those under way included."""
        self._native.save(path)

    def load(self, path: str | os.PathLike[str]) -> None:
        """Replace the contents and the capacity with those that :meth:`save` wrote.

        Call :meth:`resume` before recording on, or end or discard the episodes under way.

        Raises:
            OSError: If the file cannot be read.
            ValueError: If it holds no buffer for such environments.
        """
        self._native.load(path)

    def __getstate__(self) -> dict[str, Any]:
        """Return what pickling and copying keep: all episodes, those under way included."""
        state = self.__dict__.copy()
        shape = self._native.capacity, self._native.num_envs
        state["_native"] = (*shape, self._native.to_bytes())
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Recreate the buffer with the episodes that it had."""
        capacity, num_envs, contents = state.pop("_native")
        self.__dict__.update(state)
        self._native = _native.Buffer(_native.Config(**self._make), capacity, num_envs)
        self._native.set_bytes(contents)
