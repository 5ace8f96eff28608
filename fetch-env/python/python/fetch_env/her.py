"""The hindsight replay buffer."""

from __future__ import annotations

import math
import os
import warnings
import weakref
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import gymnasium
import numpy as np

from . import _native
from .recorded import recorded_vector
from .rewards import GoalRewards, episode_len, own_rewards, refuse_own_rewards
from .spaces import parts

if TYPE_CHECKING:
    from gymnasium.vector import VectorEnv
    from numpy.typing import ArrayLike, NDArray

    from .env import Observation
    from .rewards import Reward
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

    Its transitions are of one kind: of one task, reward, distance threshold, number of substeps and
    model. Ranges of goals and objects may differ.

    Relabelled transitions get the rewards of the environment's settings, or those of ``reward``;
    the others keep their own. Several threads may use a buffer: their calls wait for each other.

    Args:
        env: The environment, one or many, that determines lengths and rewards; wrappers may be
            around it.
        capacity: Number of transitions; the oldest episodes make room for new ones.
        reward: A function of achieved goals and desired goals, ``float32`` arrays of shape (N, 3),
            and infos, a list of N empty dictionaries, that returns the N rewards of a whole batch.
        seed: Fixes the sequence of batches that :meth:`sample` draws without a seed. By default it
            comes from the system.

    Raises:
        ValueError: If the environment, a wrapper or a subclass has rewards of its own and
            ``reward`` is not given, or an episode is longer than the capacity.
    """

    # What pickles without them had.
    _reward: Reward | None = None
    _episode_len: int | None = None
    # What copies and pickles lack: the environment, and its settings when they were compared.
    _env: weakref.ref[GoalRewards] | None = None
    _known: _native.Config | None = None

    def __init__(
        self,
        env: gymnasium.Env[Any, Any] | VectorEnv[Any, Any, Any],
        capacity: int,
        *,
        reward: Reward | None = None,
        seed: int | None = None,
    ) -> None:
        """Create an empty buffer; see the class."""
        inner: Any = getattr(env, "unwrapped", env)
        if not isinstance(inner, GoalRewards):
            kind = type(inner).__name__
            message = f"{kind} is not a FetchEnv or a FetchVectorEnv: pass one, wrapped or not"
            raise TypeError(message)
        if reward is None:
            refuse_own_rewards(own_rewards(env))
        elif not callable(reward):
            message = f"reward is {reward!r}: pass a function"
            raise TypeError(message)
        self._make: ConfigArguments = inner.config_arguments()
        self._episode_len = episode_len(env)
        self._reward = reward
        self._seeds = Seeds(seed)
        num_envs = 1 if isinstance(env, gymnasium.Env) else env.num_envs
        self._native = self._empty(capacity, num_envs)
        self._env = weakref.ref(inner)
        self._check_env()

    def _check_env(self) -> None:
        """Raise an error if the environment's reward was changed by assigning attributes."""
        inner = None if self._env is None else self._env()
        if inner is not None and inner._config is not self._known:  # noqa: SLF001
            self._native.check_kind(inner._config)  # noqa: SLF001
            self._known = inner._config  # noqa: SLF001

    def _empty(self, capacity: int, num_envs: int) -> _native.Buffer:
        config, has_own_reward = _native.Config(**self._make), self._reward is not None
        return _native.Buffer(config, capacity, num_envs, self._episode_len, has_own_reward)

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
            ValueError: If the environments have transitions of another kind (see the class), if
                this was recorded before, if results before it were not recorded, or if
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
        env_index: int = 0,
    ) -> None:
        """Add what a step of one environment returned to the episode that was begun.

        The episode is stored when it ends: by its last step, or by :meth:`end_episode`.

        Raises:
            ValueError: If no episode is under way, a number is not finite, the observation has
                another goal than the one with which the episode began, or the environment with
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
            seed: Draws the same batch from the same contents. Without a seed, each call draws anew,
                from the buffer's own sequence: that of its ``seed``, or one that no other buffer
                has. A copy continues the sequence. In a forked process the sequence starts anew,
                unless the buffer was made with a seed.

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
            seed = self._seeds.draw()
        return self._native.sample(batch_size, strategy, k / (k + 1.0), seed, self._reward)

    def clear(self) -> None:
        """Remove all transitions."""
        self._native.clear()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write all episodes to a file, those under way included."""
        self._native.save(path)

    def load(self, path: str | os.PathLike[str]) -> None:
        """Replace the contents and the capacity with those that :meth:`save` wrote.

        Call :meth:`resume` before recording on, or end or discard the episodes under way. A warning
        says that a file does not tell what it holds, as those of Rust programs: then only lengths
        are compared.

        Raises:
            OSError: If the file cannot be read.
            ValueError: If it holds no buffer, or transitions of another kind; see the class.
        """
        if not self._native.load(path):
            message = f"{path} does not say what it holds: make sure that it is {self._native.task}"
            warnings.warn(message, stacklevel=2)

    def __getstate__(self) -> dict[str, Any]:
        """Return what pickling and copying keep: all episodes, those under way included."""
        state = self.__dict__.copy()
        del state["_env"], state["_known"]
        shape = self._native.capacity, self._native.num_envs
        state["_native"] = (*shape, self._native.to_bytes())
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Recreate the buffer with the episodes that it had."""
        capacity, num_envs, contents = state.pop("_native")
        self.__dict__.update({"_env": None, "_known": None, "_seeds": Seeds(None), **state})
        self._native = self._empty(capacity, num_envs)
        self._native.set_bytes(contents)


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
