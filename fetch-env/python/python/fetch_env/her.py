"""The hindsight replay buffer."""

from __future__ import annotations

import math
import warnings
import weakref
from typing import TYPE_CHECKING, Any

import gymnasium

from . import _native
from .adding import Adding
from .kinds import method_of, native_kind, other_kind, reward_of
from .rewards import GoalRewards, check_function, episode_len, own_rewards, refuse_own_rewards
from .sampling import all_to_json, fields_of, to_json
from .seeds import Seeds

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from gymnasium.vector import VectorEnv
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Unpack

    from .kinds import OtherKind
    from .rewards import Reward, Terminated
    from .sampling import GoalStrategy, Mirror, MotionlessEpisodes, Priorities, Sampling
    from .settings import ConfigArguments

#: The ``k`` of the paper.
K = 4.0


class HerBuffer(Adding):
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

    Relabelled transitions get the rewards of the environment's settings or task, or those of
    ``reward``; the others keep their own. Several threads may use a buffer: their calls wait for
    each other.

    Other goal-conditioned environments of Gymnasium have one, too, if ``observation``,
    ``achieved_goal``, ``desired_goal`` and the action are vectors::

        env = gymnasium.make("PointMaze_UMaze-v3")
        buffer = fetch_env.HerBuffer(env, capacity=1_000_000)
        observation, _ = env.reset(seed=0)
        buffer.begin_episode(observation)
        action = env.action_space.sample()
        observation, reward, terminated, truncated, _ = env.step(action)
        buffer.add_step(action, observation, reward, terminated=terminated, truncated=truncated)

    Their steps are added with :meth:`begin_episode` and :meth:`add_step`, other keys of the
    observation are left out, and ``reward`` and ``terminated`` are by default their
    ``compute_reward`` and ``compute_terminated``, with which the buffer is pickled.

    Args:
        env: The environment, one or many, that determines lengths and rewards; wrappers may be
            around it.
        capacity: Number of transitions; the oldest episodes make room for new ones.
        reward: A function of achieved goals and desired goals, ``float32`` arrays of shape (N, 3),
            or of the length of other goals, and infos, a list of N empty dictionaries, that returns
            the N rewards of a whole batch.
        terminated: A function of the same arguments that returns whether each of N steps ends the
            task, for the setting ``termination`` of :meth:`sample`. By default none does.
        fields: Lengths of additional vectors of every transition, by name, such as
            ``{"log_prob": 1}``.
        priorities: Settings of priorities to draw by, such as ``{"unit": "transition"}``.
        mirror: How an environment of another package looks in a mirror, for ``mirrored`` of
            :meth:`sample`; see :class:`fetch_env.Mirror`.
        motionless_episodes: Keeps only a share of the episodes in which the achieved goal hardly
            moves, such as ``{"max_distance": 0.01, "kept": 0.1}`` (a bias). By default all are.
        seed: Fixes the sequence of batches that :meth:`sample` draws without a seed. By default it
            comes from the system.

    Raises:
        ValueError: If the environment, a wrapper or a subclass has rewards of its own and
            ``reward`` is not given, an episode is longer than the capacity, or a setting is wrong.
        TypeError: If the environment is not goal-conditioned, or its parts are no vectors.
    """

    # What pickles without them had.
    _reward: Reward | None = None
    _terminated: Terminated | None = None
    _settings: str = "{}"
    _mirror: str | None = None
    _episode_len: int | None = None
    # What copies and pickles lack: the environment, and its settings when they were compared.
    _env: weakref.ref[GoalRewards] | None = None
    _known: _native.Config | None = None

    def __init__(  # noqa: PLR0913
        self,
        env: gymnasium.Env[Any, Any] | VectorEnv[Any, Any, Any],
        capacity: int,
        *,
        reward: Reward | None = None,
        terminated: Terminated | None = None,
        fields: Mapping[str, int] | None = None,
        priorities: Priorities | None = None,
        motionless_episodes: MotionlessEpisodes | None = None,
        mirror: Mirror | None = None,
        seed: int | None = None,
    ) -> None:
        """Create an empty buffer; see the class."""
        inner: Any = getattr(env, "unwrapped", env)
        if isinstance(inner, GoalRewards):
            self._make: ConfigArguments | OtherKind = inner.config_arguments()
            if reward is None:
                refuse_own_rewards(own_rewards(env))
        else:
            self._make = other_kind(env)
            reward = reward_of(env) if reward is None else reward
            terminated = method_of(env, "compute_terminated") if terminated is None else terminated
        check_function("reward", reward)
        check_function("terminated", terminated)
        self._episode_len = episode_len(env)
        self._reward = reward
        self._terminated = terminated
        chosen = {"priorities": priorities, "motionless_episodes": motionless_episodes}
        fields = {} if fields is None else fields
        self._settings = all_to_json(fields=fields_of(fields), **chosen)
        self._mirror = None if mirror is None else to_json("mirror", mirror)
        self._seeds = Seeds(seed)
        num_envs = 1 if isinstance(env, gymnasium.Env) else env.num_envs
        self._native = self._empty(capacity, num_envs)
        self._env = weakref.ref(inner) if isinstance(inner, GoalRewards) else None
        self._known = None
        self._check_env()

    def _check_env(self) -> None:
        """Raise an error if the environment's reward was changed by assigning attributes."""
        inner = None if self._env is None else self._env()
        if inner is not None and inner._config is not self._known:  # noqa: SLF001
            self._native.check_kind(inner._config)  # noqa: SLF001
            self._known = inner._config  # noqa: SLF001

    def _empty(self, capacity: int, num_envs: int) -> _native.Buffer:
        kind, has_own_reward = native_kind(self._make), self._reward is not None
        return _native.Buffer(
            kind,
            capacity,
            num_envs,
            self._episode_len,
            has_own_reward,
            self._settings,
            self._mirror,
        )

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

    @property
    def transition_ids(self) -> tuple[int, int] | None:
        """Numbers of the oldest and the newest transition that can be drawn, if there is any.

        All between them can be drawn, too. Numbers rise, and those of an episode are consecutive.
        """
        return self._native.transition_ids

    def sample(
        self,
        batch_size: int,
        *,
        strategy: GoalStrategy = "future",
        k: float = K,
        seed: int | None = None,
        **settings: Unpack[Sampling],
    ) -> dict[str, NDArray[Any]]:
        """Draw a batch.

        Args:
            batch_size: Number of transitions.
            strategy: Where the new goals come from: from later in the episode, its end, anywhere in
                it, any episode, the goals that episodes pursued (``"past_desired"``), or soon after
                the step (``{"geometric": {"gamma": 0.9}}``).
            k: Ratio of relabelled to original transitions: on average, ``k`` of every ``k + 1`` get
                a new goal.
            seed: Draws the same batch from the same contents. Without a seed, each call draws anew,
                from the buffer's own sequence: that of its ``seed``, or one that no other buffer
                has. A copy continues the sequence. In a forked process the sequence starts anew,
                unless the buffer was made with a seed.
            **settings: See :class:`fetch_env.Sampling`.

        Returns:
            New arrays with a row for each transition, which ``torch.from_numpy`` takes without a
            copy: ``observation``, ``achieved_goal``, ``desired_goal``, ``action``,
            ``next_observation``, ``next_achieved_goal`` and ``reward`` of ``float32``;
            ``terminated``, ``truncated`` and ``relabeled`` (whether the goal is new) of ``bool``;
            ``transition``, the numbers of the transitions, and ``goal_source``, those of the
            transitions that achieved the new goals (0 without one), of ``int64``; ``fields_NAME``
            for each field; and those that a setting adds.

        Raises:
            ValueError: If a setting is wrong, or no episode has ended yet.
        """
        if not 0.0 <= k < math.inf:
            message = f"k is {k}: pass a number from 0 on"
            raise ValueError(message)
        if seed is None:
            seed = self._seeds.draw()
        if "goals" in settings and strategy != "future":
            message = "pass either strategy or goals, a mixture of strategies"
            raise ValueError(message)
        if "ratio" in settings and k != K:
            message = "pass either k or ratio, which is k / (k + 1)"
            raise ValueError(message)
        return self._native.sample(
            batch_size,
            to_json("strategy", strategy),
            k / (k + 1.0),
            seed,
            all_to_json(**settings),
            self._reward,
            self._terminated,
        )

    def set_priorities(self, transitions: ArrayLike, priorities: ArrayLike) -> None:
        """Set the priorities of transitions, or of their episodes.

        A priority is itself the weight of a draw: for prioritized replay, pass
        ``(abs(td_error) + epsilon) ** alpha``. Transitions that were overwritten are left out.

        Args:
            transitions: Numbers of shape (N,): ``transition`` of a batch.
            priorities: Numbers of shape (N,), from 0 to 1e200.
        """
        self._native.set_priorities(transitions, priorities)

    def priority(self, transition: int) -> float | None:
        """Return the priority of a transition, or of its episode; ``None`` if it has none."""
        return self._native.priority(transition)

    def append(self, other: HerBuffer) -> None:
        """Add copies of all finished episodes of another buffer.

        Raises:
            ValueError: If it has transitions of another kind, or other fields.
        """
        if not isinstance(other, HerBuffer):
            message = f"other is {type(other).__name__}: pass a fetch_env.HerBuffer"
            raise TypeError(message)
        self._native.append(other._native)

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

    def export_npz(self, path: str | os.PathLike[str]) -> None:
        """Write all finished episodes as an archive of arrays that ``numpy.load`` reads.

        For E episodes of N transitions in total: ``episode_lengths`` (E,), ``observations`` and
        ``achieved_goals`` (N + E, length), ``desired_goals`` (E, 3), ``actions`` (N, 4),
        ``rewards`` (N,), ``terminated`` and ``truncated`` (E,), and ``fields_NAME`` (N, length).
        """
        self._native.export_npz(path)

    def import_npz(self, path: str | os.PathLike[str]) -> int:
        """Add all episodes of an archive in the form of :meth:`export_npz`.

        Returns:
            Their number.
        """
        return self._native.import_npz(path)

    def import_minari(self, folder: str | os.PathLike[str]) -> int:
        """Add all episodes of a Minari data set in Arrow format to a buffer without fields.

        Rewards are those of the data set. An episode becomes several if its goal changes.

        Args:
            folder: The one of the data set, as :func:`fetch_env.write_dataset` writes it.

        Returns:
            Their number.
        """
        return self._native.import_minari(folder)

    def import_ogbench(self, path: str | os.PathLike[str]) -> int:
        """Add all trajectories of a data set for OGBench to a buffer without fields.

        Rewards are those of the buffer: of the environment's settings, or of ``reward``.

        Args:
            path: The archive, as :func:`fetch_env.write_dataset` writes it.

        Returns:
            Their number.
        """
        return self._native.import_ogbench(path, self._reward)

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
