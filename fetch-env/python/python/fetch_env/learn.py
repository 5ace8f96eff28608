"""Learning and evaluating, in Rust and without torch."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from . import _native
from .policy import Policy

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from typing_extensions import Unpack

    from .settings import Settings

#: Evaluations in a row that must reach the target.
EVALUATIONS = 2


@dataclass(frozen=True)
class Training:
    """The result of :func:`train`."""

    policy: Policy
    """The policy that was learned."""
    curve: list[dict[str, Any]]
    """A row for each evaluation: ``counters`` (steps, episodes, updates, seconds, ...),
    ``success_rate`` (value and 95 % interval), ``episode_return_mean``, ``final_distance_mean`` (in
    meters) and more."""
    settings: dict[str, Any]
    """The settings of the learner."""


def train(  # noqa: PLR0913
    env_id: str,
    preset: str | Mapping[str, Any] = "fast",
    *,
    seed: int = 0,
    steps: int = 2_000_000,
    target: float | None = 0.9,
    num_threads: int = 2,
    progress: bool | Callable[[dict[str, Any]], object] = True,
    **settings: Unpack[Settings],
) -> Training:
    """Learn a task with hindsight, from rewards alone.

    ``train("FetchReach-v4", target=1.0)`` takes about a second on two cores, Push about a minute.
    The settings and the seed determine everything, on any number of threads. Ctrl-C ends it.

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        preset: ``"fast"`` (DDPG), ``"book"`` (SAC) or ``"authors"`` (the DDPG of HER's authors), or
            settings of the learner as in :class:`Training`.
        seed: Determines all random numbers.
        steps: Environment steps after which it ends.
        target: Success rate at which it ends, reached in two evaluations in a row; ``None`` to use
            all steps.
        num_threads: Number of threads.
        progress: Whether to show a line of progress on standard error, or a function that takes
            each row of the curve.
        **settings: See :class:`fetch_env.Settings`.

    Raises:
        ValueError: If a setting is out of its range, or the training diverges.
        FileNotFoundError: If there is no such model.
        fetch_env.SimulationError: If the physics became unstable.
    """
    preset = preset if isinstance(preset, str) else json.dumps(preset)
    config = _native.Config(env_id, **settings)
    trainer = _native.Trainer(config, preset, seed, num_threads)
    curve: list[dict[str, Any]] = []
    while trainer.steps() < steps and not _is_reached(curve, target):
        row = trainer.cycle(steps)
        if row is not None:
            curve.append(json.loads(row))
            if callable(progress):
                progress(curve[-1])
        if progress is True:
            _show(trainer.steps(), steps, curve)
    if progress is True:
        sys.stderr.write("\n")
    return Training(Policy(trainer.policy()), curve, json.loads(trainer.settings()))


def _is_reached(curve: list[dict[str, Any]], target: float | None) -> bool:
    last = [row["success_rate"]["value"] for row in curve[-EVALUATIONS:]]
    return target is not None and len(last) == EVALUATIONS and min(last) >= target


def _show(done: int, steps: int, curve: list[dict[str, Any]]) -> None:
    """Replace the line of progress."""
    width = 30
    bar = "#" * (width * min(done, steps) // steps)
    success = f", success rate {curve[-1]['success_rate']['value']:.2f}" if curve else ""
    sys.stderr.write(f"\r[{bar:<{width}}] {done:,} of at most {steps:,} steps{success}")
    sys.stderr.flush()


def evaluate(
    env_id: str,
    policy: Policy,
    episodes: int = 100,
    *,
    seed: int = 0,
    num_threads: int = 0,
    **settings: Unpack[Settings],
) -> dict[str, Any]:
    """Run episodes of a policy. Ctrl-C ends it.

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        policy: The policy.
        episodes: Number of episodes.
        seed: Seed of the first episode; each further one has the next.
        num_threads: Number of threads; 0 for one for each core.
        **settings: See :class:`fetch_env.Settings`.

    Returns:
        ``success_rate``, ``success_any_rate``, ``episode_return_mean``, ``episode_length_mean`` and
        ``final_distance_mean`` (in meters), each with its 95 % interval.

    Raises:
        ValueError: If there is no episode, or the policy does not fit the environment.
        FileNotFoundError: If there is no such model.
        fetch_env.SimulationError: If the physics became unstable.
    """
    config = _native.Config(env_id, **settings)
    native = policy._native  # noqa: SLF001
    summary: dict[str, Any] = json.loads(
        _native.evaluate(config, native, episodes, seed, num_threads)
    )
    return summary
