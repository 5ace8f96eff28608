"""Many environments, as Stable-Baselines3 takes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from fetch_env.numbering import StepNumbers
from fetch_env.vector import FetchVectorEnv

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from typing_extensions import Unpack

    from fetch_env.settings import EpisodeOptions, Settings
    from fetch_env.spaces import Observation


class FetchVecEnv(VecEnv):
    """Fetch environments that are stepped together, as Stable-Baselines3 takes them.

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        num_envs: Number of environments.
        num_threads: Number of threads; by default one for each core.
        episode_options: See :class:`fetch_env.FetchVectorEnv`.
        render_mode: ``"rgb_array"`` to draw.
        **settings: See :class:`fetch_env.Settings`.
    """

    def __init__(
        self,
        env_id: str,
        num_envs: int = 1,
        *,
        num_threads: int | None = None,
        episode_options: EpisodeOptions | None = None,
        render_mode: str | None = None,
        **settings: Unpack[Settings],
    ) -> None:
        """Create the environments; see the class."""
        self.envs = FetchVectorEnv(
            env_id,
            num_envs,
            autoreset_mode="SameStep",
            num_threads=num_threads,
            episode_options=episode_options,
            render_mode=render_mode,
            **settings,
        )
        spaces = self.envs.single_observation_space, self.envs.single_action_space
        super().__init__(num_envs, *spaces)
        self.metadata = self.envs.metadata
        self._step_numbers = [StepNumbers() for _ in range(num_envs)]
        self._seen = self.envs._native.numbers()  # noqa: SLF001

    def reset(self) -> Observation:
        """Begin an episode in each environment, with the seeds of ``seed``."""
        seeds = None if self._seeds[0] is None else self._seeds
        observations, _ = self.envs.reset(
            seed=seeds, options=self._options if any(self._options) else None
        )
        self._reset_seeds()
        self._reset_options()
        for env_index, numbers in enumerate(self._step_numbers):
            numbers.begin(_row(observations, env_index))
        self._seen = self.envs._native.numbers()  # noqa: SLF001
        return observations

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Start a step; with a single thread, :meth:`step_wait` takes it on the caller's."""
        if self.envs.num_threads > 1:
            self.envs.step_async(actions)
        else:
            self._actions = actions

    def step_wait(
        self,
    ) -> tuple[Observation, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Wait for the step, and return its results."""
        many = self.envs.num_threads > 1
        steps = self.envs.step_wait() if many else self.envs.step(self._actions)
        observations, rewards, terminated, truncated, infos = steps
        dones = terminated | truncated
        final = infos.get("final_info", {}).get("is_success")
        each: list[dict[str, Any]] = []
        seen, self._seen = self._seen, self.envs._native.numbers()  # noqa: SLF001
        for env_index, done in enumerate(dones.tolist()):
            numbers = self._step_numbers[env_index]
            success = final if done else infos["is_success"]
            cut_off = done and not terminated[env_index]
            info = {"is_success": success[env_index], "TimeLimit.truncated": cut_off}
            if done:
                info["terminal_observation"] = infos["final_obs"][env_index]
            if self._seen[env_index] != seen[env_index] + 1:
                numbers.lose()  # something else has used the vector inside
            numbers.count(info)
            if done:
                numbers.begin(_row(observations, env_index))
            each.append(info)
        return observations, rewards.astype(np.float32), dones, each

    def close(self) -> None:
        """End the threads, and free the simulations."""
        self.envs.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Draw each environment."""
        return self.envs.render() or (None,) * self.num_envs

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Get an attribute of environments; see :meth:`fetch_env.FetchVectorEnv.call`."""
        return [
            self.envs._attribute(env_index, attr_name)  # noqa: SLF001
            for env_index in self._get_indices(indices)
        ]

    def set_attr(self, attr_name: str, value: object, indices: Any = None) -> None:
        """Refuse: settings are passed when environments are made."""
        del indices
        self.envs.set_attr(attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of environments; see :meth:`fetch_env.FetchVectorEnv.call`."""
        methods = self.get_attr(method_name, indices)
        return [method(*method_args, **method_kwargs) for method in methods]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Tell that no environment is wrapped."""
        del wrapper_class
        return [False for _ in self._get_indices(indices)]


def _row(observations: Observation, env_index: int) -> Observation:
    return {part: numbers[env_index] for part, numbers in observations.items()}
