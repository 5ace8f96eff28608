"""A hindsight replay buffer for Stable-Baselines3."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import RewardWrapper
from stable_baselines3.common.buffers import BaseBuffer
from stable_baselines3.common.preprocessing import get_action_dim
from stable_baselines3.common.type_aliases import DictReplayBufferSamples
from stable_baselines3.common.vec_env import VecNormalize, unwrap_vec_normalize
from stable_baselines3.her import GoalSelectionStrategy
from stable_baselines3.her import HerReplayBuffer as TheirHerReplayBuffer

from fetch_env import _native
from fetch_env.kinds import native_kind
from fetch_env.numbering import KEY, begins_at, next_of
from fetch_env.rewards import TIME_LIMIT, ChangesRewards, check_function, refuse_own_rewards
from fetch_env.sampling import all_to_json, to_json

from .parts import Parts

if TYPE_CHECKING:
    import torch
    from gymnasium import spaces
    from numpy.typing import NDArray
    from stable_baselines3.common.vec_env import VecEnv
    from typing_extensions import Unpack

    from fetch_env.kinds import OtherKind
    from fetch_env.numbering import Next, StepNumber
    from fetch_env.rewards import Reward, Terminated
    from fetch_env.sampling import Sampling
    from fetch_env.settings import ConfigArguments
    from fetch_env.spaces import Observation

#: Settings of a draw that Stable-Baselines3 has no place for, and what to do.
REFUSED = {
    "ratio": "pass n_sampled_goal",
    "success": "compute the distance of the goals",
    "priorities": "use fetch_env.HerBuffer with a learner that weighs its losses",
    "joined_goal": "use MultiInputPolicy, which joins the parts of observations",
}


class HerReplayBuffer(TheirHerReplayBuffer):
    """The buffer of ``fetch_env`` in place of Stable-Baselines3's ``HerReplayBuffer``.

    Pass it as ``replay_buffer_class``. It takes the same arguments and draws from the same
    distribution, from numpy's global random numbers, which ``set_random_seed`` seeds. Episodes are
    drawn from once they end. Saving keeps those that are under way, and ``load_replay_buffer`` ends
    them.

    Relabelled transitions get the rewards of the environment's settings, or those of ``reward`` in
    ``replay_buffer_kwargs``: a function of achieved goals and desired goals, ``float32`` arrays of
    shape (N, 3), and infos, a list of N empty dictionaries, that returns the N rewards of a whole
    batch. The others keep their own. ``terminated``, and settings of :class:`fetch_env.Sampling`,
    go there, too, except those of which an error says what else to do; ``n_step`` needs
    Stable-Baselines3 2.7 or later.

    An episode also ends, and another begins, where its goal changes. Where an environment is used
    otherwise, an episode ends with the steps it has: when ``learn`` is called again, after
    ``set_env`` and ``evaluate_policy``, and after a reset or a step of your own. Stable-Baselines3
    then acts once on an observation of before, and this step, which never happened, is not stored.
    For that, the environments add ``"fetch_env.step"`` to the infos. Within ``VecNormalize``, the
    last observation of an episode is the one that Stable-Baselines3 gives to its own buffer, too:
    normalized, clipped and scaled back.

    Other goal-conditioned environments have it, too, with any keys in their observations that are
    vectors of numbers. Relabelled rows get the rewards of their ``compute_reward``, or of
    ``reward``. As their steps have no numbers, the first one after a use of your own may join what
    did not follow, as in Stable-Baselines3's own buffer, and a step with another goal than the one
    before is not stored.

    Raises:
        ValueError: If an environment, a wrapper or a subclass has rewards of its own and ``reward``
            is not given, an episode is longer than the buffer, or the buffer is given environments
            with transitions of another kind (see :class:`fetch_env.HerBuffer`).
        TypeError: If observations are no dictionaries with goals, or have images.
    """

    # What pickles without them had.
    _reward: Reward | None = None
    _terminated: Terminated | None = None
    _sampling: str = "{}"
    _episode_len: int | None = None

    def __init__(  # noqa: PLR0913, PLR0917
        self,
        buffer_size: int,
        observation_space: spaces.Dict,
        action_space: spaces.Space[Any],
        env: VecEnv,
        device: torch.device | str = "auto",
        n_envs: int = 1,
        optimize_memory_usage: bool = False,  # noqa: FBT001, FBT002
        handle_timeout_termination: bool = True,  # noqa: FBT001, FBT002
        n_sampled_goal: int = 4,
        goal_selection_strategy: GoalSelectionStrategy | str = "future",
        copy_info_dict: bool = False,  # noqa: FBT001, FBT002
        reward: Reward | None = None,
        terminated: Terminated | None = None,
        **settings: Unpack[Sampling],
    ) -> None:
        """Create an empty buffer; see the class."""
        del optimize_memory_usage
        if copy_info_dict:
            message = (
                "copy_info_dict=True asks for infos, which this buffer does not store: pass "
                "reward=, a function of the goals, or use Stable-Baselines3's HerReplayBuffer"
            )
            raise ValueError(message)
        self._parts = Parts(observation_space)
        BaseBuffer.__init__(self, buffer_size, observation_space, action_space, device, n_envs)
        self.env = env
        self.handle_timeout_termination = handle_timeout_termination
        self.n_sampled_goal = n_sampled_goal
        self.her_ratio = 1 - 1 / (n_sampled_goal + 1)
        if not isinstance(goal_selection_strategy, str):
            goal_selection_strategy = goal_selection_strategy.name
        self._strategy = goal_selection_strategy.lower()
        for name, instead in REFUSED.items():
            if name in settings:
                message = f"Stable-Baselines3 has no place for {name}: {instead}"
                raise ValueError(message)
        self._sampling = all_to_json(**settings)
        self._reward, self._terminated = reward, terminated
        if reward is None:
            self._refuse_own_rewards(env)
        check_function("reward", reward)
        check_function("terminated", terminated)
        self._make = self._kinds(env)[0]
        self._episode_len = max(env.get_attr(TIME_LIMIT)) if env.has_attr(TIME_LIMIT) else None
        self._native = self._empty()
        self._native.check_sampling(self._sampling)
        self._next: list[Next | None] = [None] * n_envs
        self._number_steps(env)
        self._check_kind(env)

    @staticmethod
    def _refuse_own_rewards(env: VecEnv) -> None:
        is_ours = env.has_attr("config_arguments")
        if any(env.env_is_wrapped(ChangesRewards if is_ours else RewardWrapper)):  # type: ignore[arg-type]
            refuse_own_rewards("a wrapper")
        if is_ours:
            for name in env.env_method("own_rewards"):
                refuse_own_rewards(name)
        elif not env.has_attr("compute_reward"):
            message = "the environments have no compute_reward: pass reward="
            raise ValueError(message)

    def _kinds(self, env: VecEnv) -> list[ConfigArguments | OtherKind]:
        """Return the settings of Fetch environments, and the lengths of others."""
        if env.has_attr("config_arguments"):
            kinds: list[ConfigArguments | OtherKind] = env.env_method("config_arguments")
            return kinds
        lengths = *Parts(env.observation_space).lengths(), get_action_dim(env.action_space)
        return [("other environments", *lengths)]

    def _check_kind(self, env: VecEnv) -> None:
        for kind in self._kinds(env):
            self._native.check_kind(native_kind(kind))

    def _number_steps(self, env: VecEnv) -> None:
        """Let Fetch environments number their steps; ours for Stable-Baselines3 always do."""
        if env.has_attr("number_steps"):
            env.env_method("number_steps")

    def _empty(self) -> _native.Buffer:
        kind, has_own_reward = native_kind(self._make), self._reward is not None
        self._config = None if isinstance(kind, tuple) else kind
        return _native.Buffer(
            kind, self.buffer_size, self.n_envs, self._episode_len, has_own_reward
        )

    def _judge(self, method: str) -> Reward | None:
        """Return a method of other environments as a function of a batch."""
        env = self.env
        if self._config is not None or env is None or not env.has_attr(method):
            return None
        return lambda *goals: env.env_method(method, *goals, indices=[0])[0]

    def set_env(self, env: VecEnv) -> None:
        """Go on with an environment, after the buffer was loaded.

        Raises:
            ValueError: If it has transitions of another kind; see :class:`fetch_env.HerBuffer`.
        """
        self._check_kind(env)
        super().set_env(env)
        self._number_steps(env)

    def add(  # type: ignore[override]  # noqa: PLR0913, PLR0917
        self,
        obs: Observation,
        next_obs: Observation,
        action: NDArray[np.float32],
        reward: NDArray[np.float32],
        done: NDArray[np.bool_],
        infos: list[dict[str, Any]],
    ) -> None:
        """Store a step of each environment.

        Raises:
            ValueError: If a reward is not that of the environment's settings, as a wrapper gives,
                and there is no ``reward`` to relabel with, if one action took several steps, or if
                a number cannot be stored.
        """
        cut_off = [bool(info.get("TimeLimit.truncated", False)) for info in infos]
        terminated = [each and not cut for each, cut in zip(done.tolist(), cut_off, strict=True)]
        normalizes = self.env is not None and unwrap_vec_normalize(self.env) is not None
        goal, next_goal = obs["desired_goal"], next_obs["desired_goal"]
        if normalizes:
            # It clips the last observations of episodes, which the buffer gets.
            next_goal = np.where(done[:, None], goal, next_goal)
        # Where steps have no numbers, or VecNormalize has been used by others, another goal may be
        # that of another episode.
        keeps_goal = (goal == next_goal).all(axis=1)
        took_place = [
            took and (keeps or (KEY in info and not normalizes))
            for took, keeps, info in zip(
                self._took_place(obs, done.tolist(), infos), keeps_goal, infos, strict=True
            )
        ]
        is_checked = [
            took and not (normalizes and last) for took, last in zip(took_place, done, strict=True)
        ]
        if self._reward is None and self._config is not None:
            self._config.check_rewards(next_obs["achieved_goal"], next_goal, reward, is_checked)
        self._native.add_steps(
            *self._parts.columns(obs),
            action.reshape(self.n_envs, self.action_dim),
            *self._parts.columns({**next_obs, "desired_goal": next_goal}),
            reward,
            terminated,
            cut_off,
            took_place,
        )

    def _took_place(
        self, obs: Observation, done: list[bool], infos: list[dict[str, Any]]
    ) -> list[bool]:
        """Tell for each environment whether its step began at the observation.

        Steps have no numbers after ``set_env``, of which the buffer is not told.
        """
        took_place = []
        for env_index, info in enumerate(infos):
            number: StepNumber | None = info.get(KEY)
            if number is None:
                took_place.append(True)
                self._next[env_index] = None
            else:
                expected = self._next[env_index]
                took_place.append(begins_at(number, expected, obs, env_index))
                self._next[env_index] = next_of(number, done=done[env_index])
        return took_place

    def sample(  # type: ignore[override]
        self, batch_size: int, env: VecNormalize | None = None
    ) -> DictReplayBufferSamples:
        """Draw a batch.

        Raises:
            ValueError: If no episode has ended yet.
        """
        if not self.size():
            message = (
                "no episode has ended yet, and only ended ones are drawn from: set learning_starts "
                f"to at least {self.n_envs * (self._episode_len or 1)}, the steps that "
                f"{self.n_envs} episodes take"
            )
            raise ValueError(message)
        seed = int(np.random.randint(2**63))  # noqa: NPY002
        batch = self._native.sample(
            batch_size,
            to_json("goal_selection_strategy", self._strategy),
            self.her_ratio,
            seed,
            self._sampling,
            self._reward or self._judge("compute_reward"),
            self._terminated or self._judge("compute_terminated"),
        )
        observations, next_observations = (
            self._normalize_obs(
                self._parts.of(
                    batch[f"{when}observation"],
                    batch[f"{when}achieved_goal"],
                    batch["desired_goal"],
                ),
                env,
            )
            for when in ("", "next_")
        )
        dones = batch["terminated"]
        if not self.handle_timeout_termination:
            dones = dones | batch["truncated"]
        rewards = self._normalize_reward(batch["reward"].reshape(-1, 1), env)
        discounts = {}
        if "discount" in batch:
            discounts["discounts"] = self._tensor(batch["discount"].reshape(-1, 1))
        return DictReplayBufferSamples(
            observations=self._to_torch(observations),
            actions=self.to_torch(
                batch["action"].astype(self._maybe_cast_dtype(self.action_space.dtype), copy=False),
                copy=False,
            ),
            next_observations=self._to_torch(next_observations),
            dones=self._tensor(dones.reshape(-1, 1).astype(np.float32)),
            rewards=self._tensor(rewards),
            **discounts,
        )

    def _to_torch(self, parts: Any) -> dict[str, torch.Tensor]:
        return {part: self._tensor(numbers) for part, numbers in parts.items()}

    def _tensor(self, numbers: NDArray[np.float32]) -> torch.Tensor:
        # Nothing else uses the array, so it is not copied.
        return self.to_torch(numbers.astype(np.float32, copy=False), copy=False)

    def size(self) -> int:
        """Return the number of transitions of finished episodes."""
        return len(self._native)

    def reset(self) -> None:
        """Remove all transitions."""
        self._native.clear()

    def truncate_last_trajectory(self) -> None:
        """End the episodes that are under way."""
        for env_index in range(self.n_envs):
            if self._native.unfinished_steps(env_index):
                warnings.warn("the episode under way is cut off", stacklevel=2)
                self._native.end_episode(env_index)

    def __getstate__(self) -> dict[str, Any]:
        """Return what pickling keeps: everything but the environment."""
        state = {**super().__getstate__(), "_native": self._native.to_bytes()}
        state.pop("_config")
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Recreate the buffer; ``set_env`` is not needed to draw from it."""
        contents = state.pop("_native")
        state.setdefault("_next", [None] * state["n_envs"])
        state.setdefault("_parts", Parts(state["observation_space"]))
        super().__setstate__(state)
        self._native = self._empty()
        self._native.set_bytes(contents)
