"""Common parts of one environment and many: how they are made, copied and drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .attributes import Attributes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._native import Env, VecEnv
    from .settings import Settings

RENDER_MODES = ("rgb_array", "depth_array")


class MadeFromSettings(Attributes):
    """A native part that can be recreated from its settings, and continued from its state."""

    render_mode: str | None
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

    def _make(self) -> None:
        raise NotImplementedError

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


#: What `_make` makes.
_MADE = ("_config", "_model", "_native")
