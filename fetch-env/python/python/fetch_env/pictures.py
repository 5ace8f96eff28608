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


#: The modes, and the kinds of their pictures.
RENDER_MODES: dict[str | None, Kind] = {"rgb_array": "rgb", "depth_array": "depth"}
