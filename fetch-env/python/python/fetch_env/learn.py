"""Learning and evaluating, in Rust and without torch."""

from __future__ import annotations

import contextlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from .acting import acting
from .pictures import seen
from .policy import Policy
from .progress import Progress
from .settings import make_config

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from typing_extensions import Unpack

    from .acting import Act, Model
    from .pictures import Pixels
    from .settings import Settings


@dataclass(frozen=True, repr=False)
class Training:
    """The result of :func:`train`."""

    policy: Policy
    """The policy that was learned."""
    curve: list[dict[str, Any]]
    """A row for each evaluation, with ``counters`` (steps, episodes, updates, seconds, ...),
    ``success_rate`` (value and 95 % interval), ``episode_return_mean``, ``final_distance_mean`` (in
    meters), and ``diagnostics``: numbers by their names, such as ``update/target`` and
    ``update/critic_gradient_norm`` of the last update, and ``buffer/distance``,
    ``buffer/success`` and ``buffer/relabeled_success`` of what is learned from."""
    settings: dict[str, Any]
    """The settings of the learner."""
    interrupted: bool = False
    """Whether Ctrl-C ended it."""

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the policy to a file, for :meth:`Policy.load` and the program's ``--policy``.

        With ``out``, :func:`train` writes the same policy, with its success rate, at the end of a
        run: ``policy.safetensors``.

        Raises:
            OSError: If the file cannot be written.
        """
        self.policy.save(path)

    def __repr__(self) -> str:
        """Return the environment, and how far the run has come."""
        header = self.policy.header
        text = f"{header['env_id']}, seed {header['seed']}: {header['steps']:,} steps"
        if self.curve:
            text += f", success rate {self.curve[-1]['success_rate']['value']:.2f}"
        return f"<Training on {text}{', interrupted' if self.interrupted else ''}>"


class CurveRow(dict[str, Any]):
    """A row of :attr:`Training.curve`, as a progress function gets it."""

    def __init__(self, row: Mapping[str, Any], trainer: _native.Trainer) -> None:
        """Make the row of an evaluation that was just made."""
        super().__init__(row)
        self._trainer: _native.Trainer | None = trainer

    def policy(self) -> Policy:
        """Return the policy that was evaluated.

        Raises:
            RuntimeError: If the function that got the row has returned.
        """
        if self._trainer is None:
            message = "the run has gone on: ask for the policy in the progress function"
            raise RuntimeError(message)
        return Policy(self._trainer.policy())

    def _close(self) -> None:
        self._trainer = None


def train(  # noqa: PLR0913
    env_id: str,
    preset: str | Mapping[str, Any] = "fast",
    *,
    seed: int = 0,
    steps: int = 2_000_000,
    target: float | None = 0.9,
    num_threads: int = 2,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    start: Policy | None = None,
    teacher: Policy | str | os.PathLike[str] | None = None,
    pixels: bool | Pixels = False,
    noise: Mapping[str, float] | None = None,
    tensorboard: str | os.PathLike[str] | None = None,
    progress: bool | Callable[[CurveRow], object] = True,
    **settings: Unpack[Settings],
) -> Training:
    """Learn a task with hindsight, from rewards alone, or from a teacher, and from pictures.

    ``train("FetchReach-v4", target=1.0)`` takes a few seconds on two cores, and Push about a
    minute, evaluations included, which ``counters["seconds"]`` of a row leaves out. The settings
    and the seed determine everything, on any number of threads.

    Ctrl-C ends it and returns what it has reached. So does a progress function that returns
    ``False``::

        def keep(row):
            row.policy().save("best.safetensors")
            return row["counters"]["seconds"] < 600

        training = fetch_env.train("FetchPush-v4", progress=keep)

    An exception, such as one of that function, has what was reached in its attribute ``training``,
    unless the policy is no longer finite.

    With ``out``, the run has a folder as those of the program ``fetch-env train``: ``curve.csv``,
    ``run.json``, checkpoints of every half minute and of the end, whatever ends it, and after its
    last step or its target ``policy.safetensors`` and ``page.html``. If the process or the machine
    stops, call it again with ``resume=True``, or run ``fetch-env train --resume``: either continues
    what the other began, with the same bits as if it had not been stopped.

    With a ``teacher``, a student imitates it in the states to which the student leads (DAgger),
    and rewards are not used. The teacher sees the state. With ``pixels``, the student sees pictures
    instead, the robot's own numbers and the goal, so that the state is needed in training alone::

        training = fetch_env.train("FetchPush-v4", teacher="trained", pixels=True)
        fetch_env.evaluate("FetchPush-v4", training.policy)["success_rate"]["value"]

    With ``pixels`` and no teacher, the same policy learns from rewards: a critic and another actor,
    which see the state, learn beside it. The goal is not shown in its pictures.

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        preset: ``"fast"`` (DDPG), ``"book"`` (SAC) or ``"authors"`` (the DDPG of HER's authors);
            ``"fast-ppo"`` or ``"book-ppo"`` (PPO, for dense rewards); or settings of the learner as
            in :class:`Training`.
        seed: Determines all random numbers.
        steps: Environment steps after which it ends.
        target: Success rate at which it ends, reached in two evaluations in a row; ``None`` to use
            all steps.
        num_threads: Number of threads; 0 for one for each core.
        out: Folder of the run, which one process at a time uses.
        resume: Whether to continue the run in ``out``, if there is one.
        start: A policy whose actor and normalizers the run starts from, also one of another task
            with the same lengths, such as Push for PickAndPlace. The normalizers stay as they are.
            The critic begins anew, so the policy becomes much worse before it becomes better,
            unless ``actor_learning_rate`` is small, such as 0.0001. The first ``random_episodes``
            are random. The run must have layers of the same sizes; a resumed one does not need it.
        teacher: Whom a student imitates: a policy that sees the state or its file, ``"trained"``
            (the one that comes with the package) or ``"scripted"``. Settings in ``preset`` are
            those of :attr:`Training.settings` of such a run, such as ``hidden``. The program's
            planner is no teacher: it would have to plan anew from each state.
        pixels: Whether the policy sees pictures, or a dictionary of what differs from the usual
            ones: see :class:`fetch_env.Pixels`.
        noise: Standard deviations of noise that the policy learns to stand: ``"observation"`` on
            what the actor sees, in the units of the observation, while the critic learns from exact
            ones, and ``"action"`` on actions, as ``variation={"action_noise": ...}``. Evaluations
            have the second alone.
        tensorboard: A folder where TensorBoard finds the curve, with the names of the columns of
            ``curve.csv``; a resumed run adds a file.
        progress: Whether to show progress on standard error, or a function that takes each row of
            the curve as a :class:`CurveRow`.
        **settings: See :class:`fetch_env.Settings`.

    Raises:
        ValueError: If an argument or a setting is out of its range or has no meaning beside the
            others, ``out`` has another run or is in use, ``start`` or ``teacher`` does not fit the
            run, or the training diverges.
        OSError: If a file of the run cannot be written or read, or there is no OpenGL for pictures.
        FileNotFoundError: If there is no such model.
        fetch_env.SimulationError: If the physics became unstable.
    """
    if not (isinstance(progress, bool) or callable(progress)):
        message = f"progress is {progress!r}: pass True, False or a function"
        raise TypeError(message)
    if not isinstance(resume, bool):
        message = f"resume is {resume!r}: pass True or False"
        raise TypeError(message)
    if resume and out is None:
        message = "there is nothing to resume: pass the folder of the run as out"
        raise ValueError(message)
    if not (start is None or isinstance(start, Policy)):
        message = f"start is {type(start).__name__}: pass a fetch_env.Policy"
        raise TypeError(message)
    # The function may change the current directory.
    out = None if out is None else Path(out).absolute()
    learner = preset if isinstance(preset, str) else json.dumps(preset)
    observation_noise = _take_noise(noise or {}, settings)
    student = _student(teacher, pixels, start, observation_noise)
    config = make_config(env_id, **settings)
    native = None if start is None else start._native  # noqa: SLF001
    trainer = _native.Trainer(
        config,
        learner,
        seed,
        steps,
        target,
        num_threads,
        out,
        resume,
        native,
        tensorboard,
        observation_noise,
        *student,
    )
    shown = Progress(f"{config.env_id}, seed {seed}", steps) if progress is True else None
    interrupted = False
    try:
        try:
            _run(trainer, progress if callable(progress) else None, shown)
        except KeyboardInterrupt:
            interrupted = True
        return _training(trainer, interrupted=interrupted)
    except BaseException as error:
        with contextlib.suppress(Exception):
            error.__dict__["training"] = _training(trainer, interrupted=interrupted)
        raise
    finally:
        trainer.close()


def _take_noise(noise: Mapping[str, float], settings: Settings) -> float | None:
    """Add the noise of actions to settings, and return that of observations."""
    for name in set(noise) - {"observation", "action"}:
        message = f"noise has the key {name!r}: pass 'observation' or 'action'"
        raise ValueError(message)
    if "action" in noise:
        settings["variation"] = {**settings.get("variation", {}), "action_noise": noise["action"]}
    return noise.get("observation")


def _student(
    teacher: Policy | str | os.PathLike[str] | None,
    pixels: bool | Pixels,  # noqa: FBT001
    start: Policy | None,
    observation_noise: float | None,
) -> tuple[_native.Policy | str | None, tuple[Any, Any, bool] | None]:
    """Return teacher and pictures as the native module takes them."""
    pictures = seen(pixels)
    if teacher is None and pictures is None:
        return None, None
    if start is not None or observation_noise is not None:
        message = (
            "start and noise of observations have no meaning with a teacher or pixels: "
            "leave them out"
        )
        raise ValueError(message)
    if teacher is None:
        return None, pictures
    if isinstance(teacher, Policy):
        return teacher._native, pictures  # noqa: SLF001
    try:
        return os.fspath(teacher), pictures
    except TypeError:
        message = f"teacher is {type(teacher).__name__}: pass a fetch_env.Policy, a name or a file"
        raise TypeError(message) from None


def _run(
    trainer: _native.Trainer,
    watch: Callable[[CurveRow], object] | None,
    shown: Progress | None,
) -> None:
    """Train to the end, or until ``watch`` returns ``False``, and save what was reached."""
    try:
        _take_cycles(trainer, watch, shown)
    finally:
        if shown is not None:
            shown.close()
        trainer.save()
    trainer.finish()


def _take_cycles(
    trainer: _native.Trainer,
    watch: Callable[[CurveRow], object] | None,
    shown: Progress | None,
) -> None:
    while True:
        goes_on, json_row = trainer.cycle()
        if not goes_on:
            return
        row = None if json_row is None else CurveRow(json.loads(json_row), trainer)
        if shown is not None:
            shown.show(trainer.steps(), row)
        if row is not None and watch is not None:
            try:
                answer = watch(row)
            finally:
                row._close()  # noqa: SLF001
            if isinstance(answer, (bool, np.bool_)) and not answer:
                return


def _training(trainer: _native.Trainer, *, interrupted: bool) -> Training:
    curve, settings = json.loads(trainer.curve()), json.loads(trainer.settings())
    return Training(Policy(trainer.policy()), curve, settings, interrupted)


def evaluate(  # noqa: PLR0913
    env_id: str,
    policy: Policy | Model | Act,
    episodes: int = 100,
    *,
    batched: bool = False,
    seed: int = 0,
    num_threads: int = 0,
    **settings: Unpack[Settings],
) -> dict[str, Any]:
    """Run episodes of a policy. Ctrl-C ends it.

    ::

        model = stable_baselines3.SAC.load("push.zip")
        fetch_env.evaluate("FetchPush-v4", model)["success_rate"]["value"]

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        policy: A policy, which sees its own pictures if it sees any; a model of Stable-Baselines3,
            whose ``predict`` is called with ``deterministic=True``; or a function of an observation
            that returns its action, of shape (4,). A function is called on this thread, for one
            episode after the other, and its method ``reset``, if it has one, before each. An
            exception ends the call.
        episodes: Number of episodes.
        batched: Whether a function takes many observations, parts of shape (N, length) from N
            environments, of which some may have ended their episode, and returns actions of shape
            (N, 4). This is faster, and ``reset`` is called when all N begin.
        seed: Seed of the first episode; each further one has the next.
        num_threads: Number of threads; 0 for one for each core.
        **settings: See :class:`fetch_env.Settings`.

    Returns:
        ``success_rate``, ``success_any_rate``, ``episode_return_mean``, ``episode_length_mean``,
        ``final_distance_mean`` (in meters), and what the policy does as a controller:
        ``steps_to_success_mean`` (``None`` without a success), ``action_change_mean`` (squared),
        ``largest_action_mean``, ``path_mean`` of the gripper (in meters) and ``energy_mean`` (sum
        of squared actions), each with its 95 % interval.

    Raises:
        ValueError: If there is no episode, or the policy does not fit the environment.
        FileNotFoundError: If there is no such model.
        fetch_env.SimulationError: If the physics became unstable.
    """
    config = make_config(env_id, **settings)
    native = acting(policy, batched=batched)
    summary: dict[str, Any] = json.loads(
        _native.evaluate(config, *native, episodes, seed, num_threads)
    )
    return summary


def robustness(  # noqa: PLR0913
    env_id: str,
    policy: Policy | Model | Act,
    factor: str,
    values: Sequence[float],
    episodes: int = 100,
    *,
    batched: bool = False,
    seed: int = 0,
    num_threads: int = 0,
    **settings: Unpack[Settings],
) -> dict[str, Any]:
    """Run episodes of a policy at each value of a factor. Ctrl-C ends it.

    ::

        policy = fetch_env.Policy.shipped("FetchPush-v4")
        noise = [0, 0.01, 0.02, 0.05]
        curve = fetch_env.robustness("FetchPush-v4", policy, "observation_noise", noise)
        rates = [point["success_rate"]["value"] for point in curve["points"]]

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        policy: A policy, a model or a function, as for :func:`evaluate`.
        factor: What has the values: noise, delays or physics, by a name of ``variation``.
        values: The values.
        episodes: Number of episodes at each value.
        batched: Whether a function takes many observations.
        seed: Seed of the first episode; each further one has the next.
        num_threads: Number of threads; 0 for one for each core.
        **settings: See :class:`fetch_env.Settings`.

    Returns:
        ``factor``; ``points``, each with its ``value`` and all that :func:`evaluate` returns; and
        for ``success`` at the last step and ``success_any`` at any: ``critical_value``, the first
        whose rate is below 0.5, if any, ``slope`` of the straight line through the rates, and
        ``area`` under them.

    Raises:
        ValueError: If there is no such factor, a value is out of its range, there is no episode, or
            the policy does not fit the environment.
        FileNotFoundError: If there is no such model.
        fetch_env.SimulationError: If the physics became unstable.
    """
    config = make_config(env_id, **settings)
    native = acting(policy, batched=batched)
    curve: dict[str, Any] = json.loads(
        _native.robustness(config, *native, factor, values, episodes, seed, num_threads)
    )
    return curve
