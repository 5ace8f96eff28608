"""Gymnasium's renderer of MuJoCo, as programs use it."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from .pictures import RENDER_MODES

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclasses.dataclass
class MujocoRenderer:
    """What programs read, assign and call of Gymnasium's class of this name.

    Assigned values count from the next picture on, also in :meth:`fetch_env.FetchEnv.render`.
    """

    _env: Any
    width: int
    height: int
    camera_id: int
    """Index of a camera of the model; -1 for the free one."""
    default_cam_config: Mapping[str, Any] | None
    """The free camera, as ``default_camera_config`` of :class:`fetch_env.FetchEnv`."""

    def render(self, render_mode: str | None) -> Any:
        """Draw as ``"rgb_array"``, ``"depth_array"`` (meters) or both as ``"rgbd_tuple"`` say."""
        if render_mode == "rgbd_tuple":
            return self.render("rgb_array"), self.render("depth_array")
        if render_mode not in RENDER_MODES:
            message = (
                f"there is no picture {render_mode!r}: pass one of {(*RENDER_MODES,)}, or make the "
                'environment with render_mode="human"'
            )
            raise ValueError(message)
        camera: Any = self.default_cam_config or "free"
        if self.camera_id >= 0:
            camera = self._env.camera_names[self.camera_id + 1]
        kind = RENDER_MODES[render_mode]
        return self._env.draw(self.width, self.height, camera=camera, kind=kind)

    def close(self) -> None:
        """Do nothing: the environment frees its renderers."""
