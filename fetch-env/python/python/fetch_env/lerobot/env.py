"""The environment for LeRobot's evaluation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.envs.registration import register, registry
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGE, OBS_STATE

from fetch_env import ENV_IDS
from fetch_env.env import FetchEnv
from fetch_env.spaces import ACTION_LEN

from .features import STATE, environment_state, instruction, split

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from typing_extensions import Unpack

    from fetch_env.settings import Settings

#: What an observation has, in LeRobot's words.
OBS_TYPES = ("environment_state_agent_pos", "pixels_agent_pos")
#: Gymnasium's prefix of the environments.
NAMESPACE = "fetch_env_lerobot"


class LeRobotFetchEnv(gymnasium.Env[dict[str, Any], "NDArray[np.float32]"]):
    """A Fetch environment with the observations that LeRobot's evaluation takes.

    Its observations have ``agent_pos`` and, by ``obs_type``, ``environment_state`` or ``pixels``:
    see :mod:`fetch_env.lerobot`. As in the benchmark, an episode never ends before its time limit,
    and succeeds if it does at its last step, the only one whose info has ``is_success``.

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        obs_type: ``"environment_state_agent_pos"`` or ``"pixels_agent_pos"``.
        episode_length: Number of steps.
        render_mode: See :class:`fetch_env.FetchEnv`.
        width: Width of pictures in pixels.
        height: Height of pictures in pixels.
        **settings: See :class:`fetch_env.Settings`.
    """

    metadata: dict[str, Any] = FetchEnv.metadata

    def __init__(  # noqa: PLR0913
        self,
        env_id: str,
        *,
        obs_type: str = OBS_TYPES[0],
        episode_length: int = 50,
        render_mode: str = "rgb_array",
        width: int = 256,
        height: int = 256,
        **settings: Unpack[Settings],
    ) -> None:
        """Create the environment; see the class."""
        if obs_type not in OBS_TYPES:
            message = f"there is no obs_type {obs_type!r}: choose from {', '.join(OBS_TYPES)}"
            raise ValueError(message)
        self._env = FetchEnv(
            env_id, render_mode=render_mode, width=width, height=height, **settings
        )
        self.metadata = self._env.metadata
        self._has_pixels = obs_type == "pixels_agent_pos"
        self._steps = 0
        # LeRobot reads these three.
        self._max_episode_steps = episode_length
        self.task = env_id
        self.task_description = instruction(env_id)
        self.render_mode = render_mode
        self.action_space = self._env.action_space
        self.observation_space = gymnasium.spaces.Dict(
            {
                "agent_pos": _unbounded(len(STATE)),
                "pixels": gymnasium.spaces.Box(0, 255, (height, width, 3), np.uint8),
            }
            if self._has_pixels
            else {
                "agent_pos": _unbounded(len(STATE)),
                "environment_state": _unbounded(
                    len(environment_state(has_object=self._env.has_object))
                ),
            }
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode; see :meth:`fetch_env.FetchEnv.reset`."""
        observation, info = self._env.reset(seed=seed, options=options)
        self._steps = 0
        return self._seen(observation), info

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Take an action: ``[dx, dy, dz, fingers]``, of shape (4,)."""
        observation, reward, terminated, truncated, info = self._env.step(action)
        self._steps += 1
        truncated = truncated or self._steps >= self._max_episode_steps
        # LeRobot counts an episode as a success if any of its steps says so.
        last = {"is_success": bool(info["is_success"])} if truncated else {}
        return self._seen(observation), reward, terminated, truncated, last

    def render(self) -> NDArray[Any] | None:
        """Draw the current state; see :meth:`fetch_env.FetchEnv.render`."""
        return self._env.render()

    def close(self) -> None:
        """Free the simulation."""
        self._env.close()

    def _seen(self, observation: dict[str, NDArray[np.float64]]) -> dict[str, Any]:
        state, environment = split(observation)
        if self._has_pixels:
            return {"agent_pos": state, "pixels": self._env.render()}
        return {"agent_pos": state, "environment_state": environment}


def _unbounded(length: int) -> gymnasium.spaces.Box:
    return gymnasium.spaces.Box(-np.inf, np.inf, (length,), np.float32)


@EnvConfig.register_subclass("fetch")
@dataclass
class FetchEnvConfig(EnvConfig):
    """The settings of ``--env.type=fetch``, for LeRobot's ``make_env``."""

    task: str | None = "FetchPush-v4"
    fps: int = 25
    episode_length: int = 50
    obs_type: str = OBS_TYPES[0]
    render_mode: str = "rgb_array"
    observation_height: int = 256
    observation_width: int = 256
    model: str = "builtin"
    features: dict[str, PolicyFeature] = field(
        default_factory=lambda: {
            ACTION: PolicyFeature(type=FeatureType.ACTION, shape=(ACTION_LEN,)),
            "agent_pos": PolicyFeature(type=FeatureType.STATE, shape=(len(STATE),)),
        }
    )
    features_map: dict[str, str] = field(
        default_factory=lambda: {
            ACTION: ACTION,
            "agent_pos": OBS_STATE,
            "environment_state": OBS_ENV_STATE,
            "pixels": OBS_IMAGE,
        }
    )

    def __post_init__(self) -> None:
        """Describe what the policy sees.

        Raises:
            ValueError: If there is no environment or no ``obs_type`` of this name.
        """
        if self.task not in ENV_IDS:
            message = f"there is no task {self.task!r}: choose from {', '.join(ENV_IDS)}"
            raise ValueError(message)
        if self.obs_type == "pixels_agent_pos":
            shape: tuple[int, ...] = (self.observation_height, self.observation_width, 3)
            self.features["pixels"] = PolicyFeature(type=FeatureType.VISUAL, shape=shape)
        elif self.obs_type == "environment_state_agent_pos":
            has_object = not self.task.startswith("FetchReach")
            shape = (len(environment_state(has_object=has_object)),)
            self.features["environment_state"] = PolicyFeature(type=FeatureType.ENV, shape=shape)
        else:
            message = f"there is no obs_type {self.obs_type!r}: choose from {', '.join(OBS_TYPES)}"
            raise ValueError(message)

    @property
    def package_name(self) -> str:
        """The module that registers the environments, which LeRobot imports."""
        return "fetch_env.lerobot"

    @property
    def gym_id(self) -> str:
        """The name of the environment in Gymnasium."""
        return f"{NAMESPACE}/{self.task}"

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """The arguments of :class:`LeRobotFetchEnv`."""
        return {
            "obs_type": self.obs_type,
            "episode_length": self.episode_length,
            "render_mode": self.render_mode,
            "width": self.observation_width,
            "height": self.observation_height,
            "model": self.model,
        }


for _env_id in ENV_IDS:
    if f"{NAMESPACE}/{_env_id}" not in registry:
        register(
            id=f"{NAMESPACE}/{_env_id}",
            entry_point="fetch_env.lerobot:LeRobotFetchEnv",
            order_enforce=False,  # the environment does it
            kwargs={"env_id": _env_id},
        )
