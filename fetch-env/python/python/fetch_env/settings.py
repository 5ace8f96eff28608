"""The keywords that change an environment's settings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypedDict

if TYPE_CHECKING:
    import os

    from typing_extensions import Required


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
    target_offset: tuple[float, float, float]
    """Offset of every goal: x, y, z in meters."""
    target_in_the_air: bool
    """Whether half of the goals are raised by up to 45 cm."""


class ConfigArguments(Settings, total=False):
    """The settings, with the name of the environment."""

    env_id: Required[str]
    """The name, such as ``"FetchPush-v4"``."""
