"""One environment."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Any, cast

import gymnasium
import numpy as np
from gymnasium.utils import seeding

from . import _native, spaces
from .attributes import IS_NEVER_CALLED, Hook, attribute, constant, setting
from .made import MadeFromSettings
from .mujoco_renderer import MujocoRenderer
from .numbering import StepNumbers
from .pictures import RENDER_MODES
from .settings import make_config
from .simulation import Simulated
from .spaces import Observation

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray
    from typing_extensions import Unpack

    from ._native import Env
    from .settings import EpisodeOptions, Settings

#: Settings without an effect in Reach.
NEED_AN_OBJECT = ("obj_range", "target_offset", "target_in_the_air")


def generator(random: tuple[int, int] | None) -> np.random.Generator | None:
    """Return numpy's generator after a number of draws since a seed."""
    if random is None:
        return None
    seed, draws = random
    return np.random.Generator(np.random.PCG64(seed).advance(draws))


def seed_of(random: tuple[int, int] | None) -> int | None:
    """Return the seed of random numbers."""
    return None if random is None else random[0]


class FetchEnv(MadeFromSettings, Simulated, gymnasium.Env[Observation, "NDArray[np.float32]"]):
    """A Fetch environment, as in gymnasium-robotics 1.4.2.

    An action is ``[dx, dy, dz, fingers]``, each from -1 to 1 and clipped: the first three move the
    gripper's target by up to 5 cm along the world's axes, the last opens (positive) or closes the
    fingers. ``float32`` actions are computed in single precision, ``float64`` ones in double. An
    observation is a dictionary of new ``float64`` arrays:

    - ``observation``: 10 numbers in Reach, 25 elsewhere. Positions are in meters in the world
      frame, velocities in meters or radians per control step, and angles in radians.
    - ``achieved_goal``: x, y, z in meters, of the gripper in Reach, of the object elsewhere.
    - ``desired_goal``: x, y, z in meters.

    ``info["is_success"]`` is 1.0 while the two goals are within 5 cm of each other, and 0.0
    otherwise. ``gymnasium.make`` adds the time limit of 50 steps; without it episodes never end.

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        render_mode: ``"rgb_array"`` or ``"depth_array"`` to use :meth:`render`. ``gymnasium.make``
            also takes ``"human"``, and shows a window through pygame.
        width: Width of pictures in pixels, 1 to 4096.
        height: Height of pictures in pixels, 1 to 4096.
        camera_name: The camera of pictures, one of :attr:`camera_names`.
        default_camera_config: ``distance`` (meters), ``azimuth``, ``elevation`` (degrees) and
            ``lookat`` (x, y, z in meters) of the camera ``"free"``, which draws unless
            ``camera_name`` says otherwise. What is left out is the reference's.
        episode_options: A function that returns the options of each :meth:`reset` without any, or
            ``None``. It takes 0, and the number of resets before; see :class:`FetchVectorEnv`.
        **settings: See :class:`fetch_env.Settings`.

    Raises:
        ValueError: If a name, a setting, an action or an option is invalid.
        FileNotFoundError: If there is no such model.
        fetch_env.MujocoError: If MuJoCo's library cannot be loaded.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": [*RENDER_MODES],
        "render_fps": 25,
    }

    _native: Env
    _numbers: StepNumbers | None = None

    def __init_subclass__(cls, **keywords: Any) -> None:
        """Refuse methods of a subclass that only the reference calls."""
        super().__init_subclass__(**keywords)
        for name in cls.__dict__:
            if isinstance(vars(Simulated).get(name), Hook):
                message = f"{cls.__name__} defines {name}: {IS_NEVER_CALLED}"
                raise TypeError(message)

    def __init__(  # noqa: PLR0913
        self,
        env_id: str,
        *,
        render_mode: str | None = None,
        width: int = 480,
        height: int = 480,
        camera_name: str | None = None,
        default_camera_config: Mapping[str, Any] | None = None,
        episode_options: EpisodeOptions | None = None,
        **settings: Unpack[Settings],
    ) -> None:
        """Create the environment; see the class."""
        if "max_episode_steps" in settings:
            message = (
                "one environment has no time limit: pass max_episode_steps to gymnasium.make, or "
                "use gymnasium.wrappers.TimeLimit"
            )
            raise TypeError(message)
        self._episode_options = episode_options
        self._num_episodes = 0
        picture = (width, height, camera_name, default_camera_config)
        self._make_from(env_id, settings, render_mode, picture)
        self.action_space = spaces.action_space()  # type: ignore[assignment]
        self.observation_space = spaces.observation_space(self._config)  # type: ignore[assignment]

    def _make(self) -> None:
        self._config = make_config(self._env_id, **self._settings)
        width, height, camera_name, default_camera = self._picture
        self._native = _native.Env(self._config, *self._picture)
        self._model: Any = None
        camera_id = self.camera_names.index(camera_name or "free") - 1
        # A weak reference, with which the environment is freed once nobody else uses it.
        self._renderer = MujocoRenderer(
            weakref.proxy(self), width, height, camera_id, default_camera
        )

    def _change(self, name: str, value: Any) -> None:
        if name == "goal":
            self._native.set_goal(value)
            return
        if not self.has_object and name in NEED_AN_OBJECT:
            message = f"{name} has no effect in a task without an object: leave it out"
            raise ValueError(message)
        name = {"obj_range": "object_range"}.get(name, name)
        settings: dict[str, Any] = {**self._settings, name: value}
        config = make_config(self._env_id, **settings)
        self._native.set_config(config)
        # The value that was checked, which nobody can change.
        settings[name] = getattr(config, name)
        self._config, self._settings = config, cast("Settings", settings)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode, whether or not the last one is over.

        Args:
            seed: Restarts the random numbers as numpy's ``PCG64(SeedSequence(seed))``: 0 to
                2**64 - 1. Without a seed, they continue.
            options: These replace what is drawn, and do not change the sequence of random numbers.
                Lengths are in meters, in the world frame:

                - ``desired_goal``: x, y, z.
                - ``object_position``: x, y. ``object_height``: of its center, instead of on the
                  table. ``object_rotation``: a quaternion w, x, y, z.
                - ``gripper_position``: x, y, z. The arm moves there before the episode begins.
                - ``object_in_gripper``: whether the fingers hold the object, in PickAndPlace.
                - ``variation``: such as ``{"object_mass": 0.5, "table_color": (0.2, 0.5, 0.2)}``.

        Returns:
            The first observation, and an info that is empty, like the reference's, unless factors
            were drawn or set: ``info["variation"]`` has them.
        """
        if options is None and self._episode_options is not None:
            options = self._episode_options(0, self._num_episodes)
        observation = self._native.reset(seed, options)
        self._num_episodes += 1
        if self._numbers is not None:
            self._numbers.begin(observation)
        variation = self.variation
        return observation, {"variation": variation} if variation else {}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Take an action: ``[dx, dy, dz, fingers]``, of shape (4,).

        Returns:
            The observation, the reward, whether the task has ended (never), whether the episode was
            cut off (never without a time limit), and the info.

        Raises:
            gymnasium.error.ResetNeeded: Before a reset, and after a failure.
            fetch_env.SimulationError: If the physics became unstable.
        """
        results = self._native.step(action)
        if self._numbers is not None:
            self._numbers.count(results[4])
        return results

    def number_steps(self) -> None:
        """Add to the info of every step its number, by which replay buffers notice other uses.

        :class:`fetch_env.sb3.HerReplayBuffer` calls it. Nothing else changes.
        """
        if self._numbers is None:
            self._numbers = StepNumbers()

    def render(self) -> NDArray[Any] | None:
        """Draw the current state, without changing it.

        Returns:
            Colors (height, width, 3) of ``uint8``, or distances from the camera (height, width) in
            meters of ``float32``, the top row first; ``None`` without a ``render_mode``.

        Raises:
            gymnasium.error.ResetNeeded: Before a reset.
        """
        if self.render_mode is not None:
            return self._renderer.render(self.render_mode)  # type: ignore[no-any-return]
        gymnasium.logger.warn(
            "render() needs a mode: make the environment with render_mode='rgb_array'"
        )
        return None

    def get_state(self) -> bytes:
        """Return all that determines the future: simulation, goal and random numbers.

        A time limit around the environment has its own state, which this leaves out.
        """
        return self._native.get_state()

    def set_state(self, state: bytes) -> Observation:
        """Restore what :meth:`get_state` of an environment with equal settings returned.

        Afterwards the same actions give the same results, bit for bit.

        Returns:
            The observation of the restored state.
        """
        self._native.set_state(state)
        observation = self._native.observe()
        if self._numbers is not None:
            self._numbers.begin(observation)
        return observation

    def close(self) -> None:
        """Free the simulation. Later calls raise ``gymnasium.error.ClosedEnvironmentError``."""
        self._native.close()

    @setting
    def goal(self) -> NDArray[np.float64]:
        """The goal of the episode, as x, y, z in meters; empty before a reset.

        An assigned goal counts from the next step until the next reset; a replay buffer then begins
        another episode. The array cannot be written to.
        """
        goal = self._native.goal()
        return constant([] if goal is None else goal)

    @attribute("pass options to reset(), or make the environment with it")
    def variation(self) -> dict[str, float]:
        """The factors that were drawn or set for the episode, by name."""
        return self._native.variation()

    @attribute("assign its camera_id or default_cam_config, or use draw()")
    def mujoco_renderer(self) -> MujocoRenderer:
        """What draws for :meth:`render`, with the names of Gymnasium's."""
        return self._renderer

    @property
    def _np_random(self) -> np.random.Generator | None:  # type: ignore[override]
        return generator(self._native.random())

    @property
    def np_random(self) -> np.random.Generator:
        """The random numbers in the state in which the last reset left them.

        A copy of the generator: drawing from it does not affect later resets, unlike in the
        reference.
        """
        return self._np_random or seeding.np_random()[0]

    @np_random.setter
    def np_random(self, value: np.random.Generator) -> None:
        del value
        message = "the random numbers cannot be replaced: pass a seed to reset()"
        raise AttributeError(message)

    @property
    def np_random_seed(self) -> int | None:  # type: ignore[override]
        """The seed of the random numbers; ``None`` before the first reset."""
        return seed_of(self._native.random())
