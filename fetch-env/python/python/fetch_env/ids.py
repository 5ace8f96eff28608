"""The names under which Gymnasium makes the environments."""

from __future__ import annotations

import contextlib
import functools
import importlib
from typing import TYPE_CHECKING, Any

from gymnasium import logger
from gymnasium.envs.registration import register, registry

from .env import FetchEnv
from .settings import make_config
from .vector import FetchVectorEnv

if TYPE_CHECKING:
    from gymnasium.envs.registration import EnvSpec
    from typing_extensions import Unpack

    from .settings import Settings

#: The names of the environments, which in Gymnasium begin with ``fetch_env/``.
ENV_IDS = tuple(
    f"Fetch{task}{reward}-v4"
    for task in ("Reach", "Push", "PickAndPlace", "Slide")
    for reward in ("", "Dense")
)

#: What the older versions of gymnasium-robotics did, unlike its ``-v4``.
OLDER = {
    "-v1": "ran on mujoco-py, with the numbers of MuJoCo 2.1 and earlier",
    "-v2": "kept the last episode's controls, mocap pose and solver's start over a reset",
    "-v3": "began episodes in the posture of the model's file, not in the settled scene",
}


@functools.cache
def newest(env_id: str) -> str:
    """Return the name of the version that stands in for an older one, and warn once of it."""
    name, version = env_id[:-3], env_id[-3:]
    logger.warn(f"{env_id} of gymnasium-robotics {OLDER[version]}: this is {name}-v4")
    return f"{name}-v4"


class OlderFetchEnv(FetchEnv):
    """The environment that stands in for an older version."""

    def __init__(self, env_id: str, **arguments: Any) -> None:
        """Create it, with a warning."""
        super().__init__(newest(env_id), **arguments)


class OlderFetchVectorEnv(FetchVectorEnv):
    """Many of them."""

    def __init__(self, env_id: str, *args: Any, **arguments: Any) -> None:
        """Create them, with a warning."""
        super().__init__(newest(env_id), *args, **arguments)


def register_own() -> None:
    """Register the environments, unless the module is reloaded."""
    for env_id in ENV_IDS:
        if f"fetch_env/{env_id}" not in registry:
            # The environment itself demands a reset before a step.
            _register(f"fetch_env/{env_id}", "fetch_env:", {"env_id": env_id}, order_enforce=False)


def replace_gymnasium_robotics(**settings: Unpack[Settings]) -> dict[str, EnvSpec]:
    """Register the names of gymnasium-robotics, so that its programs use these environments.

    ``gymnasium.make("FetchPush-v4")`` then makes ``fetch_env/FetchPush-v4``, and so do ``-v1`` to
    ``-v3``, with a warning that says what differs. gymnasium-robotics is imported before, if it is
    installed: importing it afterwards registers nothing. Only a program that itself calls
    ``gymnasium_robotics.register_robotics_envs()`` needs this call after it. A process that a
    program starts needs the call as well; at the top of the program it is made there, too.

    Args:
        **settings: For all of them, such as ``model="reference"``, with which they have the bits of
            gymnasium-robotics. See :class:`fetch_env.Settings`.

    Returns:
        What was registered by gymnasium-robotics. ``gymnasium.registry.update`` gives it back.

    Raises:
        ValueError: If something else has registered one of the names, or a setting is invalid.
            Nothing has changed then.
    """
    make_config("FetchPush-v4", **settings)
    with contextlib.suppress(ImportError):
        importlib.import_module("gymnasium_robotics")
    names = [env_id[:-3] + version for env_id in ENV_IDS for version in (*OLDER, "-v4")]
    registered = {name: registry[name] for name in names if name in registry}
    for name, spec in registered.items():
        if _package(spec) not in ("fetch_env", "gymnasium_robotics"):
            message = (
                f"{name} is registered as {spec.entry_point}: first take it out of the registry"
            )
            raise ValueError(message)
    for name in names:
        registry.pop(name, None)
        prefix = "fetch_env.ids:Older" if name[-3:] in OLDER else "fetch_env:"
        # With the reference's wrappers, which programs count: env.env.env.env.
        _register(name, prefix, {"env_id": name, **settings})
    return {name: spec for name, spec in registered.items() if _package(spec) != "fetch_env"}


def _package(spec: EnvSpec) -> str:
    entry = spec.entry_point
    module = entry if isinstance(entry, str) else getattr(entry, "__module__", "")
    return module.partition(":")[0].partition(".")[0]


def _register(name: str, prefix: str, arguments: dict[str, Any], **others: Any) -> None:
    register(
        id=name,
        entry_point=f"{prefix}FetchEnv",
        vector_entry_point=f"{prefix}FetchVectorEnv",
        max_episode_steps=50,
        kwargs=arguments,
        **others,
    )
