"""Data sets of episodes, written by LeRobot."""

from __future__ import annotations

import contextlib
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.utils.constants import ACTION, HF_LEROBOT_HOME, OBS_ENV_STATE, OBS_IMAGE, OBS_STATE

import fetch_env
from fetch_env import _native
from fetch_env.env import FetchEnv

from . import features

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator

    from numpy.typing import ArrayLike
    from typing_extensions import Unpack

    from fetch_env.settings import Settings
    from fetch_env.spaces import Observation

    Acting: TypeAlias = Callable[[Observation], ArrayLike]

#: Number of steps of an episode.
EPISODE_LENGTH = 50


def record(  # noqa: PLR0913
    env_id: str,
    policy: str | fetch_env.Policy | Acting,
    repo_id: str,
    episodes: int,
    *,
    root: str | os.PathLike[str] | None = None,
    pixels: bool = False,
    use_videos: bool = True,
    width: int = 256,
    height: int = 256,
    seed: int = 0,
    **settings: Unpack[Settings],
) -> LeRobotDataset:
    """Record a data set for LeRobot.

    A row has what the policy sees before a step (see ``fetch_env.lerobot``), ``action``, and
    ``next.reward``, ``next.success`` and ``next.done`` after it. Every episode has 50 rows, 25 for
    each second, and its task as a sentence. If recording fails, nothing is left.

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        policy: Who acts: a :class:`fetch_env.Policy`, any function from an observation to an
            action, or a name: ``"random"``, ``"scripted"``, ``"expert"``, ``"expert-noisy"`` or
            ``"mixed"``, as in :func:`fetch_env.write_dataset`.
        repo_id: The data set's name in LeRobot, such as ``"me/fetch-push"``.
        episodes: Number of episodes, at least 1.
        root: The folder of the data set; ``$HF_LEROBOT_HOME/repo_id`` if it is left out.
        pixels: Pictures in place of ``observation.environment_state``.
        use_videos: Whether LeRobot stores them as compressed videos, and not as images.
        width: Width of the pictures in pixels.
        height: Height of the pictures in pixels.
        seed: Seed of the first episode's reset; the others have the seeds that follow.
        **settings: See :class:`fetch_env.Settings`.

    Returns:
        The data set, as LeRobot loads it.

    Raises:
        ValueError: If an argument is invalid.
        FileExistsError: If the folder exists.
        OSError: If the data set cannot be written.
        fetch_env.SimulationError: If the physics became unstable.
    """
    if episodes < 1:
        message = f"episodes is {episodes}: record at least 1"
        raise ValueError(message)
    render_mode = "rgb_array" if pixels else None
    env = FetchEnv(env_id, render_mode=render_mode, width=width, height=height, **settings)
    acting = _acting(policy, env)
    folder = Path(root) if root is not None else HF_LEROBOT_HOME / repo_id
    if folder.exists():
        message = f"{folder} exists already: choose another place, or remove it"
        raise FileExistsError(message)
    picture = {
        "dtype": "video" if use_videos else "image",
        "shape": (height, width, 3),
        "names": ["height", "width", "channels"],
    }
    environment_state = features.numbers(features.environment_state(has_object=env.has_object))
    dataset = LeRobotDataset.create(
        repo_id,
        fps=round(1 / env.dt),
        root=folder,
        robot_type="fetch",
        features={
            OBS_STATE: features.numbers(features.STATE),
            **({OBS_IMAGE: picture} if pixels else {OBS_ENV_STATE: environment_state}),
            ACTION: features.numbers(features.ACTION),
            "next.reward": features.numbers(("reward",)),
            "next.success": features.numbers(("success",), "bool"),
            "next.done": features.numbers(("done",), "bool"),
        },
        use_videos=use_videos,
    )
    task = features.instruction(env_id)
    try:
        for episode_seed in range(seed, seed + episodes):
            for frame in _frames(env, acting(episode_seed), episode_seed):
                dataset.add_frame({**frame, "task": task})
            dataset.save_episode()
        dataset.finalize()
    except BaseException:
        with contextlib.suppress(Exception):
            dataset.finalize()
        shutil.rmtree(folder)
        raise
    return LeRobotDataset(repo_id, root=folder)


def _acting(policy: str | fetch_env.Policy | Acting, env: FetchEnv) -> Callable[[int], Acting]:
    """Return what begins an episode with a seed, and returns who acts in it."""
    if not isinstance(policy, str):
        return lambda _: policy
    named = _native.NamedPolicy(env._config, policy)  # noqa: SLF001

    def begin(seed: int) -> Acting:
        named.begin(seed)
        return lambda _: named.act(env._native)  # noqa: SLF001

    return begin


def _frames(env: FetchEnv, act: Acting, seed: int) -> Iterator[dict[str, Any]]:
    """Run an episode, and yield the rows of its steps."""
    observation, _ = env.reset(seed=seed)
    for step in range(EPISODE_LENGTH):
        state, environment_state = features.split(observation)
        seen = (
            {OBS_ENV_STATE: environment_state}
            if env.render_mode is None
            else {OBS_IMAGE: env.render()}
        )
        # What the environment makes of it.
        action = np.asarray(act(observation), np.float32).clip(-1, 1)
        observation, reward, _, _, info = env.step(action)
        yield {
            OBS_STATE: state,
            **seen,
            ACTION: action,
            "next.reward": np.array([reward], np.float32),
            "next.success": np.array([info["is_success"]], np.bool_),
            "next.done": np.array([step + 1 == EPISODE_LENGTH]),
        }
