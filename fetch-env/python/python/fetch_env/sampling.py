"""How a replay buffer keeps and draws transitions: settings by name, and their check."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict

import numpy as np

if TYPE_CHECKING:
    from typing_extensions import NotRequired


class Gamma(TypedDict):
    """A discount of each further step, from 0 to 1."""

    gamma: float


class Geometric(TypedDict):
    """A goal achieved j steps later, with a probability in proportion to ``gamma ** (j - 1)``."""

    geometric: Gamma


class Given(TypedDict):
    """A fixed priority, from 0 to 1e200."""

    given: float


#: Where a new goal comes from: from later in the episode, its end, anywhere in it, any episode, the
#: goals that episodes pursued, or, like ``{"geometric": {"gamma": 0.9}}``, soon after the step.
GoalStrategy: TypeAlias = (
    "Literal['future', 'final', 'episode', 'random', 'past_desired'] | Geometric"
)


class GoalPart(TypedDict):
    """A strategy in a mixture, which is used in proportion to its weight."""

    strategy: GoalStrategy
    weight: float


class NStep(TypedDict):
    """Windows of up to ``steps`` steps, with rewards discounted by ``gamma`` per step."""

    steps: int
    gamma: float


class GoalNoise(TypedDict):
    """Moves a ``share`` of the new goals by up to ``radius`` meters, uniformly in a ball."""

    radius: float
    share: float


class Priorities(TypedDict):
    """Draws by priority: the unit that has one, and that of new units."""

    unit: Literal["transition", "episode"]
    new_priority: NotRequired[Literal["highest"] | Given]
    """``"highest"`` (the default), the highest so far, or a fixed one: ``{"given": 1.0}``."""


class MotionlessEpisodes(TypedDict):
    """Keeps only a share of the episodes whose achieved goal stays within a distance, in meters."""

    max_distance: float
    kept: float
    seed: NotRequired[int]
    """Determines which are kept."""


class Mirror(TypedDict):
    """How an environment looks in a mirror: a letter for each element of its vectors.

    ``X``, ``Y`` and ``Z`` stand for a position; ``x``, ``y`` and ``z`` for a difference or a
    velocity; ``u``, ``v`` and ``w`` for a rotation about the three axes; ``.`` for what stays as it
    is. For example, a position and a velocity in the plane are ``"XYxy"``.
    """

    observation: str
    goal: str
    action: str
    axes: NotRequired[Literal["y", "x", "xy"]]
    """``"y"`` (the default) or ``"x"``, which is mirrored, or ``"xy"`` for one, the other and both
    by turns."""
    center: NotRequired[tuple[float, float]]
    """The x and y through which the mirrors pass, 0 by default."""


class Sampling(TypedDict, total=False):
    """Settings of :meth:`fetch_env.HerBuffer.sample`."""

    goals: list[GoalPart]
    """A mixture of one to six strategies, in place of ``strategy``."""
    ratio: float
    """The average share of rows that get a new goal, from 0 to 1, in place of ``k``."""
    termination: Literal["stored", "stored_or_recomputed", "recomputed"]
    """Whether rows with new goals terminate as stored (the default), also where the buffer's
    ``terminated`` says so for the new goal, or only there."""
    success: bool
    """Whether the batch has ``success``: whether the next achieved goal is within the distance
    threshold of the desired one."""
    n_step: NStep | None
    """Rows of several steps, shorter where the episode ends. ``reward`` is the discounted sum;
    the next observation and the flags are those after the last step; ``discount`` is the factor of
    the next value, 0 where the task ended."""
    priorities: float | None
    """Draws by the buffer's priorities; the number is the exponent of ``importance_weight``, from
    0 (no correction: all are 1) to 1 (full correction)."""
    parallel: bool
    """Whether all cores draw, which only large batches gain from. The batch is the same."""
    joined_goal: Literal["desired", "relative"] | None
    """The batch has ``input`` and ``next_input`` in place of observations: each followed by the
    desired goal, or by the desired minus the achieved one."""
    keep_already_achieved: float
    """The probability of keeping a row whose goal was achieved before the step; others are drawn
    again, up to three times."""
    recomputed_rewards: bool
    """Whether all rows get the buffer's rewards, not only those with new goals."""
    mirrored: float
    """The average share of rows that are mirrored, with the same rewards. The seed chooses one of
    up to three mirrors: those of a Fetch task, or of the ``mirror`` of your own
    :class:`fetch_env.Task` or of the buffer. Not for Fetch with functions passed to the buffer,
    which may judge a mirror image differently."""
    goal_noise: GoalNoise | None
    """Moves some of the new goals."""


def to_json(name: str, value: object) -> str:
    """Return a setting as the native module takes it.

    Raises:
        TypeError: If it is not of numbers, names, lists and dictionaries.
        ValueError: If a number is not finite.
    """
    try:
        return json.dumps(value, allow_nan=False, default=_plain)
    except (TypeError, ValueError) as error:
        message = f"{name} is {value!r}: pass finite numbers, names, lists or dictionaries"
        raise type(error)(message) from None


def all_to_json(**settings: object) -> str:
    """Return settings as the native module takes them; see :func:`to_json`."""
    return (
        "{" + ",".join(f'"{name}":{to_json(name, each)}' for name, each in settings.items()) + "}"
    )


def fields_of(fields: Any) -> list[dict[str, Any]]:
    """Return fields, lengths by their names, as the native module takes them."""
    try:
        return [{"name": name, "len": length} for name, length in fields.items()]
    except AttributeError:
        message = f"fields is {type(fields).__name__}: pass a dictionary of lengths by names"
        raise TypeError(message) from None


def _plain(value: object) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError
