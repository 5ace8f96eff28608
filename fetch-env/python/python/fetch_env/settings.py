"""The keywords that change an environment's settings, and their check."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict

from . import _native

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Mapping, Sequence

    from typing_extensions import Required

    from .task import Task


#: A function that returns the options of an environment's next episode.
EpisodeOptions: TypeAlias = "Callable[[int, int], dict[str, Any] | None]"

#: How a number is drawn for each episode.
Draw: TypeAlias = "float | tuple[float, float] | Mapping[str, Sequence[float]]"


class Settings(TypedDict, total=False):
    """Settings of one or many environments; what is left out is as in the reference."""

    model: str | os.PathLike[str]
    """``"builtin"`` (the default), ``"reference"`` (see
    :func:`fetch_env.download_reference_model`), or a folder with scenes of your own."""
    reward_type: Literal["sparse", "dense"]
    """Instead of the one that the environment's name says."""
    distance_threshold: float
    """Distance within which a goal counts as reached, in meters."""
    n_substeps: int
    """Physics steps of 2 ms in a control step."""
    object_range: float
    """Largest distance of the object's start from the gripper in x and y, in meters."""
    target_range: float
    """Largest distance of a goal along each axis, in meters."""
    target_offset: tuple[float, float, float] | float
    """Offset of every goal along x, y, z, in meters, or one number for all three."""
    target_in_the_air: bool
    """Whether half of the goals are raised by up to 45 cm."""
    variation: Mapping[str, Draw | Sequence[Draw]]
    """Factors that are drawn for each episode (domain randomization), by name. Each is a range as
    ``(low, high)``, a number, ``{"log_uniform": (low, high)}`` or ``{"choice": [...]}``. A color,
    such as ``table_color``, has one of these for red, green and blue alike, or three."""
    task: Task
    """A task of your own; see :class:`fetch_env.Task`. The name says which robot and object."""


class ConfigArguments(Settings, total=False):
    """The settings, with the name of the environment."""

    env_id: Required[str]
    """The name, such as ``"FetchPush-v4"``."""


#: The names of the settings, and of what time limits take.
NAMES = (*Settings.__annotations__, "max_episode_steps")


def make_config(env_id: str, **settings: Any) -> _native.Config:
    """Return checked settings.

    Raises:
        TypeError: If there is no setting of a name.
        ValueError: If a setting is out of its range.
    """
    for name in settings:
        if name not in NAMES:
            nearest = difflib.get_close_matches(name, NAMES, 1)
            hint = f": did you mean {nearest[0]}?" if nearest else ""
            # As Python says it, by which TorchRL knows what to leave out.
            message = (
                f"got an unexpected keyword argument '{name}'{hint} (the settings are "
                f"{', '.join(NAMES)})"
            )
            raise TypeError(message)
    return _native.Config(env_id, **settings)
