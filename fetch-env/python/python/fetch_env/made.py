"""Common parts of one environment and many: how they are made, copied and drawn."""

from __future__ import annotations

import dataclasses
import os
from typing import TYPE_CHECKING, Any

from gymnasium.vector import AutoresetMode

from .attributes import Attributes

if TYPE_CHECKING:
    from gymnasium.envs.registration import EnvSpec
    from numpy.typing import NDArray

    from ._native import Env, VecEnv
    from .settings import Settings

RENDER_MODES = ("rgb_array", "depth_array")


class MadeFromSettings(Attributes):
    """A native part that can be recreated from its settings, and continued from its state."""

    metadata: dict[str, Any]
    render_mode: str | None
    _spec: EnvSpec | None = None
    _native: Env | VecEnv
    _size: tuple[int, int]

    def _make_from(
        self, env_id: str, settings: Settings, render_mode: str | None, size: tuple[int, int]
    ) -> None:
        """Keep the settings, and make the native part for the first time."""
        if render_mode not in (None, *RENDER_MODES):
            message = f"there is no render mode {render_mode!r}: the modes are {RENDER_MODES}"
            raise ValueError(message)
        self.render_mode = render_mode
        self._env_id = env_id
        self._settings = settings
        self._size = size
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

    def _draw(self, *env_index: int) -> NDArray[Any]:
        """Draw colors or distances, whichever the mode asks for."""
        colors = self.render_mode == "rgb_array"
        draw = self._native.render_rgb if colors else self._native.render_depth
        picture: NDArray[Any] = draw(*env_index)
        return picture

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
    if isinstance(argument, os.PathLike):
        return os.fspath(argument)
    return argument.value if isinstance(argument, AutoresetMode) else argument


#: What `_make` makes.
_MADE = ("_config", "_model", "_native")
