"""Data sets for learning without an environment."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Literal

from . import _native
from .acting import acting
from .settings import make_config

if TYPE_CHECKING:
    import os

    from typing_extensions import Unpack

    from .acting import Act, Model
    from .policy import Policy
    from .settings import Settings


def write_dataset(  # noqa: PLR0913
    env_id: str,
    policy: Literal["random", "scripted", "expert", "expert-noisy", "mixed"] | Policy | Model | Act,
    folder: str | os.PathLike[str],
    data_format: Literal["minari", "ogbench"] = "minari",
    *,
    name: str | None = None,
    batched: bool = False,
    episodes: int = 20_000,
    seed: int = 0,
    snapshots: bool = False,
    **settings: Unpack[Settings],
) -> dict[str, Any]:
    """Write a data set, the same bytes for the same seed.

    With ``data_format="minari"`` it is what ``minari.load_dataset("fetch/push/expert-v0")`` loads
    from the folder that ``MINARI_DATASETS_PATH`` names, whose ``recover_environment()`` makes the
    environment of this package, and ``recover_environment(eval_env=True)`` that of
    gymnasium-robotics, which must be installed; with ``"ogbench"``,
    ``fetch-push-expert-v0/fetch-push-expert-v0.npz`` is what ``ogbench.utils.load_dataset`` loads.
    It appears only once it is complete; Ctrl-C ends the writing and leaves nothing. Both formats
    have dictionary observations, actions, both rewards, the seed of each episode, and ``qpos`` and
    ``qvel`` of each state.

    The set of a task of your own, such as ``fetch/stack/mine-v0`` of a class ``Stack``, has its
    spaces, but no environment to recover: a file cannot hold one.

    Args:
        env_id: The name, such as ``"FetchPush-v4"``.
        policy: Who acts. ``"random"``: uniformly random actions; ``"scripted"``: a script;
            ``"expert"``: the trained policy that comes with the package; ``"expert-noisy"``: each
            action of the trained policy is random with probability 0.3 and otherwise gets Gaussian
            noise of standard deviation 0.2; ``"mixed"``: these four, one episode each in turn. Or a
            policy, a model or a function, as for :func:`fetch_env.evaluate`.
        folder: The folder of data sets.
        data_format: ``"minari"`` or ``"ogbench"``.
        name: The name of your own policy, which becomes a part of the data set's: ``"mine"`` of
            ``fetch/push/mine-v0``. Letters, digits, dashes and underscores.
        batched: Whether a function takes many observations, here one row, and returns as many
            actions.
        episodes: Number of episodes.
        seed: Seed of the first episode; the others have the seeds that follow.
        snapshots: Also write the exact state of each step, only with ``data_format="minari"``:
            ``env.unwrapped.set_state(bytes(episode.infos["snapshot"][t]))`` restores it.
        **settings: The ``model``, ``"builtin"`` or ``"reference"``; no other setting is allowed,
            except with a ``task`` of your own, which takes all.

    Returns:
        ``success_rate`` and ``episode_return_mean`` (value and 95 % interval) and more.

    Raises:
        ValueError: If the data set exists, or an argument is invalid.
        OSError: If it cannot be written.
        FileNotFoundError: If there is no such model.
        fetch_env.SimulationError: If the physics became unstable.
    """
    config = make_config(env_id, **settings)
    if isinstance(policy, str) != (name is None):
        message = "pass name= with a policy of your own, and only then"
        raise TypeError(message)
    own = None
    if not isinstance(policy, str):
        own, batched = acting(policy, batched=batched)
    named = policy if isinstance(policy, str) else str(name)
    summary = _native.write_dataset(
        config, named, own, batched, data_format, folder, episodes, seed, snapshots
    )
    result: dict[str, Any] = json.loads(summary)
    return result
