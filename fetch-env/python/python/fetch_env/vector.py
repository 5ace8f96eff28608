"""Many environments, stepped together."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from . import _native, spaces
from .attributes import Attribute, Attributes, absent, constant
from .env import FetchEnv, generator, seed_of
from .made import MadeFromSettings
from .pictures import RENDER_MODES
from .rewards import TIME_LIMIT
from .settings import make_config
from .spaces import Observation

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray
    from typing_extensions import Unpack

    from ._native import Steps, VecEnv
    from .settings import EpisodeOptions, Settings

#: What the environments have in common, and its name in the vector.
COMMON = {
    "action_space": "single_action_space",
    "compute_reward": "compute_reward",
    "compute_terminated": "compute_terminated",
    "compute_truncated": "compute_truncated",
    "config_arguments": "config_arguments",
    "metadata": "metadata",
    "observation_space": "single_observation_space",
    "own_rewards": "own_rewards",
    "render_mode": "render_mode",
    "spec": "spec",
    TIME_LIMIT: TIME_LIMIT,
    **{name: name for name, value in vars(Attributes).items() if isinstance(value, Attribute)},
}


class FetchVectorEnv(
    MadeFromSettings, VectorEnv[Observation, "NDArray[np.float32]", "NDArray[Any]"]
):
    """Fetch environments that are stepped together, on several threads.

    Seeds, infos and autoreset are those of ``gymnasium.vector.SyncVectorEnv``, and the results
    those of single environments, bit for bit, on any number of threads. Observations are
    dictionaries of new ``float64`` arrays with a row for each environment. Actions of ``float64``
    are rounded to ``float32``.

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        num_envs: Number of environments, 1 to 65,536.
        autoreset_mode: When the next episode begins: ``gymnasium.vector.AutoresetMode``.
        num_threads: Number of threads, at most 1,024; by default one for each core. With one,
            :meth:`step` and :meth:`reset` run on the caller's thread, and only :meth:`step_async`
            uses another.
        max_episode_steps: Steps after which an episode is cut off.
        episode_options: A function that returns the options of a :meth:`reset`, or ``None``, for
            each episode that begins without any, also by an autoreset: for a curriculum. It takes
            the index of the environment and the number of episodes that this one has begun before.
            Threads of the vector call it, and :meth:`step` raises what it raises.
        render_mode: ``"rgb_array"`` or ``"depth_array"`` to use :meth:`render`.
        width: Width of pictures in pixels, 1 to 4096.
        height: Height of pictures in pixels, 1 to 4096.
        camera_name: As of :class:`fetch_env.FetchEnv`.
        default_camera_config: As of :class:`fetch_env.FetchEnv`.
        **settings: See :class:`fetch_env.Settings`.

    Raises:
        ValueError: If a name, a setting, an action or an option is invalid.
        MemoryError: If there is no memory for so many environments.
        RuntimeError: If a forked process uses environments that its parent made.
        fetch_env.SimulationError: If the physics became unstable. The others have taken their step.
            The one that failed is reset as the autoreset mode says: by the next step, in the same
            step, or, with ``DISABLED``, by a :meth:`reset` that selects it.
    """

    _native: VecEnv

    def __init__(  # noqa: PLR0913
        self,
        env_id: str,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        num_threads: int | None = None,
        max_episode_steps: int = 50,
        episode_options: EpisodeOptions | None = None,
        render_mode: str | None = None,
        width: int = 480,
        height: int = 480,
        camera_name: str | None = None,
        default_camera_config: Mapping[str, Any] | None = None,
        **settings: Unpack[Settings],
    ) -> None:
        """Create the environments; see the class."""
        self.num_envs = num_envs
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**FetchEnv.metadata, "autoreset_mode": self.autoreset_mode}
        self._num_threads = num_threads
        self._max_episode_steps = max_episode_steps
        self._episode_options = episode_options
        picture = (width, height, camera_name, default_camera_config)
        self._make_from(env_id, settings, render_mode, picture)
        self.single_action_space = spaces.action_space()
        self.single_observation_space = spaces.observation_space(self._config)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)

    def _make(self) -> None:
        self._config = make_config(
            self._env_id, max_episode_steps=self._max_episode_steps, **self._settings
        )
        self._native = _native.VecEnv(
            self._config,
            self.num_envs,
            self._num_threads or 0,
            self.autoreset_mode.value,
            *self._picture,
            self._episode_options,
        )

    def _change(self, name: str, value: Any) -> None:
        if name == "goal":
            self._native.set_goals(value)
            return
        message = (
            f"{name} cannot be set in a vector: make the environments with it, pass options to "
            "reset(), or make the vector with vectorization_mode='sync'"
        )
        raise AttributeError(message)

    mujoco_renderer = absent("use draw()")
    goal = absent('each has its own: use get_attr("goal"), and set_attr("goal", goals)')

    @property
    def num_threads(self) -> int:
        """Number of threads."""
        return self._native.num_threads

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | list[dict[str, Any] | None] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin episodes in all environments, or in those that ``options["reset_mask"]`` selects.

        Args:
            seed: A seed for each environment, or the first one's, from which the others count up.
                Without a seed, the random numbers continue.
            options: ``reset_mask`` (a boolean array), and the options of
                :meth:`fetch_env.FetchEnv.reset`, for all environments or in an array with a row for
                each. A list has the options of each environment instead, or ``None``.

        Returns:
            The observations, and an empty info. ``get_attr("variation")`` has the numbers that were
            drawn.
        """
        mask = None
        if isinstance(options, dict) and "reset_mask" in options:
            mask = self._mask(options["reset_mask"])
            options = {key: value for key, value in options.items() if key != "reset_mask"}
        return self._native.reset(self._seeds(seed), mask, options or None), {}

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None] | None:
        if seed is None:
            return None
        if isinstance(seed, (int, np.integer)):
            return [operator.index(seed) + env_index for env_index in range(self.num_envs)]
        return list(seed)

    def _mask(self, mask: object) -> list[bool]:
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            message = f"reset_mask is {mask!r}: pass a numpy array of booleans"
            raise TypeError(message)
        if mask.shape != (self.num_envs,):
            message = f"reset_mask has the shape {mask.shape}: pass ({self.num_envs},)"
            raise ValueError(message)
        chosen: list[bool] = mask.tolist()
        return chosen

    def step(self, actions: NDArray[np.float32]) -> Steps:
        """Take an action in each environment: a row of ``actions``, of shape (num_envs, 4).

        Returns:
            Observations, rewards (``float64``), whether the tasks have ended, whether the episodes
            were cut off, and the infos, as Gymnasium lays them out: ``infos["is_success"]`` where
            ``infos["_is_success"]`` is true, and with ``AutoresetMode.SAME_STEP`` ``final_obs`` and
            ``final_info`` of the episodes that have ended.
        """
        return self._native.step(actions)

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Start a :meth:`step`, for which :meth:`step_wait` waits."""
        self._native.step_async(actions)

    def step_wait(self) -> Steps:
        """Wait for the step that was started, and return its results as :meth:`step` does."""
        return self._native.step_wait()

    def render(self) -> tuple[NDArray[Any], ...] | None:
        """Draw the state of each environment, as :meth:`fetch_env.FetchEnv.render` does.

        Raises:
            gymnasium.error.ResetNeeded: Before a reset.
        """
        if self.render_mode is None:
            return None
        return tuple(self.draw(kind=RENDER_MODES[self.render_mode]))

    def _attribute(self, env_index: int, name: str) -> Any:
        """Return an attribute of an environment; a method is not yet called."""
        if name == "goal":
            goal = self._native.goal(env_index)
            return constant([] if goal is None else goal)
        if name == "variation":
            return self._native.variation(env_index)
        if name == "np_random":
            return generator(self._native.random(env_index))
        if name == "np_random_seed":
            return seed_of(self._native.random(env_index))
        if name == "render":
            return lambda: self.call(name)[env_index]
        if name not in COMMON:
            message = (
                f"the environments are not Python objects, and have no {name!r}: use the vector, "
                "or make it with vectorization_mode='sync'"
            )
            raise AttributeError(message)
        return getattr(self, COMMON[name])

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of each environment, or get an attribute of each.

        The environments are not Python objects. They have ``goal``, ``variation``,
        ``np_random``, ``np_random_seed``, ``render`` and what they share: the spaces, the settings
        and functions of goals such as ``compute_reward``.

        Raises:
            AttributeError: If they have no such attribute.
        """
        if name == "render":
            return self.render() or (None,) * self.num_envs
        values = [self._attribute(env_index, name) for env_index in range(self.num_envs)]
        return tuple(value(*args, **kwargs) if callable(value) else value for value in values)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Get an attribute of each environment; see :meth:`call`."""
        return self.call(name)

    def set_attr(self, name: str, values: object) -> None:
        """Set ``goal``, for all environments or a row for each; see :class:`fetch_env.FetchEnv`.

        Nothing else can be set: settings are passed when environments are made.
        """
        self._change(name, values)

    def get_state(self) -> bytes:
        """Return all that determines the future of all environments."""
        return self._native.get_state()

    def set_state(self, state: bytes) -> Observation:
        """Restore what :meth:`get_state` of as many environments with equal settings returned.

        Afterwards the same actions give the same results, bit for bit.

        Returns:
            The observations of the restored states, NaN where no episode has begun.
        """
        return self._native.set_state(state)

    def close_extras(self) -> None:
        """End the threads, and free the simulations."""
        # Gymnasium 1.1 and 1.2 also close what could not be made.
        if hasattr(self, "_native"):
            self._native.close()

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator | None, ...]:  # type: ignore[override]
        """The random numbers of each environment, as the last reset left them."""
        return self.get_attr("np_random")

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]
        """The seed of each environment's random numbers; ``None`` before the first reset."""
        return self.get_attr("np_random_seed")
