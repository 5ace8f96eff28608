"""Common parts of one environment and many: how they are made, copied and drawn."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from gymnasium.vector import AutoresetMode

from .attributes import IS_OF_THE_SCENE, Attributes, attribute
from .pictures import RENDER_MODES, Asked, Kind

if TYPE_CHECKING:
    from gymnasium.envs.registration import EnvSpec
    from numpy.typing import NDArray

    from ._native import Env, VecEnv
    from .settings import Settings

    #: Width, height, and the camera: its name, and what ``"free"`` is.
    Picture: TypeAlias = tuple[int, int, str | None, Mapping[str, Any] | None]


class MadeFromSettings(Attributes):
    """A native part that can be recreated from its settings, and continued from its state."""

    metadata: dict[str, Any]
    render_mode: str | None
    _spec: EnvSpec | None = None
    _native: Env | VecEnv
    _picture: Picture

    def _make_from(
        self, env_id: str, settings: Settings, render_mode: str | None, picture: Picture
    ) -> None:
        """Keep the settings, and make the native part for the first time."""
        if render_mode not in (None, *RENDER_MODES):
            message = f"there is no render mode {render_mode!r}: the modes are {(*RENDER_MODES,)}"
            raise ValueError(message)
        self.render_mode = render_mode
        self._env_id = env_id
        self._settings = settings
        self._picture = picture
        self._make()
        frames = round(1 / self._config.control_period)
        self.metadata = {**self.metadata, "render_fps": frames}

    def _make(self) -> None:
        raise NotImplementedError

    @property
    def spec(self) -> EnvSpec | None:
        """What Gymnasium made it from, with arguments that ``spec.to_json`` can write."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None:
            arguments = {name: _plain(value) for name, value in spec.kwargs.items()}
            spec = dataclasses.replace(spec, kwargs=arguments)
        self._spec = spec

    @attribute(IS_OF_THE_SCENE)
    def camera_names(self) -> tuple[str, ...]:
        """The cameras, first ``"free"``, which is not part of the model, and then the model's."""
        return ("free", *self._native.camera_names())

    def draw(  # noqa: PLR0913
        self,
        width: int | None = None,
        height: int | None = None,
        *,
        camera: str | Mapping[str, Any] | None = None,
        kind: Kind = "rgb",
        marker: bool = True,
        samples: int = 4,
    ) -> NDArray[Any]:
        """Draw the current state, without changing it; a vector draws all environments.

        Args:
            width: Width in pixels, 1 to 4096; by default as the environment was made with.
            height: Height in pixels.
            camera: One of :attr:`camera_names`, or numbers of a free camera, as in
                ``default_camera_config``; by default as the environment was made with.
            kind: ``"rgb"``, ``"depth"`` (meters along the direction in which the camera looks) or
                ``"segmentation"``.
            marker: Whether to show the goal.
            samples: Samples per pixel, for smooth edges. 0 is the fastest.

        Returns:
            An array with the top row first, ``uint8`` of shape (height, width, 3), ``float32`` of
            shape (height, width), or ``int32`` of shape (height, width, 2). The last has the id of
            the object in :attr:`FetchEnv.model` and its kind: 5 for a geom, 6 for a site, as in
            ``mujoco.mjtObj``; the sky is -1, -1. A vector's array has a leading axis, of the
            environments.

        Raises:
            gymnasium.error.ResetNeeded: Before a reset.
            ValueError: If there is no such camera or kind, or a number is out of its range.
        """
        asked = Asked(
            width=width, height=height, camera=camera, kind=kind, marker=marker, samples=samples
        )
        return self._native.draw(asked)

    def __getstate__(self) -> dict[str, Any]:
        """Return what pickling and copying keep: neither the renderer, nor threads, nor models."""
        state = {name: value for name, value in self.__dict__.items() if name not in _MADE}
        return {**state, "_native": self._native.get_state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Recreate it in the state that it had."""
        native = state.pop("_native")
        self.__dict__.update(state)
        self._make()
        self._native.set_state(native)


def _plain(argument: Any) -> Any:
    if isinstance(argument, Mapping):
        return {name: _plain(value) for name, value in argument.items()}
    if isinstance(argument, np.ndarray):
        return argument.tolist()
    if isinstance(argument, os.PathLike):
        return os.fspath(argument)
    return argument.value if isinstance(argument, AutoresetMode) else argument


#: What `_make` makes.
_MADE = ("_config", "_model", "_native", "_renderer")
