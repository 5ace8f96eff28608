"""What pictures show."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict

if TYPE_CHECKING:
    from collections.abc import Mapping

#: What a picture shows of each pixel.
Kind: TypeAlias = Literal["rgb", "depth", "segmentation"]


class Asked(TypedDict):
    """What a picture shall show: the arguments of :meth:`MadeFromSettings.draw`."""

    width: int | None
    height: int | None
    camera: str | Mapping[str, Any] | None
    kind: Kind
    marker: bool
    samples: int


class Pixels(TypedDict, total=False):
    """The pictures of a policy that learns; what is left out is as usual for the task."""

    camera: Literal["near", "reference"] | Mapping[str, Any]
    """``"near"`` (the default: goals and gripper as large as they can be), ``"reference"``, or a
    dictionary with ``distance``, ``azimuth``, ``elevation`` and ``lookat``."""
    size: int
    """Width and height, from 16 to 512, 64 by default."""
    marker: bool
    """Whether the goal is shown, ``False`` by default; ``True`` needs a teacher."""


def seen(pixels: bool | Pixels) -> tuple[Any, Any, bool] | None:  # noqa: FBT001
    """Return what a student sees as the native module takes it.

    Raises:
        TypeError: If it is neither a truth value nor a dictionary of these keys.
    """
    if isinstance(pixels, bool):
        return ("near", 64, False) if pixels else None
    if not isinstance(pixels, dict) or (others := set(pixels) - set(Pixels.__annotations__)):
        what = sorted(others) if isinstance(pixels, dict) else repr(pixels)
        message = f"pixels: pass True, or a dictionary with camera, size and marker, not {what}"
        raise TypeError(message)
    return pixels.get("camera", "near"), pixels.get("size", 64), pixels.get("marker", False)


#: The modes, and the kinds of their pictures.
RENDER_MODES: dict[str | None, Kind] = {"rgb_array": "rgb", "depth_array": "depth"}
