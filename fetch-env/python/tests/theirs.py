"""A plugin of pytest that puts our environments under the names that Gymnasium's tests use.

`cargo xtask python --their-tests <FOLDER>` runs the tests of a checkout of Gymnasium or of
gymnasium-robotics with it. Their lists of environments then have the eight of Fetch alone. Their
tests of vectors, which want arrays, get three of them with flat observations under the names of
others; those that name none are left out, since they have nothing of ours.
"""

import inspect
import sys

import fetch_env
import gymnasium
import gymnasium_robotics  # noqa: F401
import pytest
from gymnasium.wrappers import FlattenObservation

#: The files of each package, and the module from which its tests take environments. Vectors come
#: before pictures: a process that was forked cannot draw after its parent has drawn.
GYMNASIUM = ("tests/envs/test_envs.py", "tests/vector", "tests/envs/test_rendering.py")
ROBOTICS = ("tests/test_envs.py",)
MODULES = {GYMNASIUM: "gymnasium.envs.fetch", ROBOTICS: "gymnasium_robotics.envs.fetch_env"}

#: The environments that tests of vectors name, and ours.
IN_VECTORS = {
    "CartPole-v1": "FetchPush-v4",
    "FrozenLake-v1": "FetchReach-v4",
    "BipedalWalker-v3": "FetchSlide-v4",
}
#: Words in the source of tests that use environments by name.
WORDS = (*IN_VECTORS, "example_env_list", "spec")

DISCRETE = "wants discrete actions"
CARTPOLE = "asks for CartPole's gravity"
DOES_NOT_APPLY = {
    "test_step_async_vector_env": DISCRETE,
    "test_step_sync_vector_env": DISCRETE,
    "test_call_async_vector_env": CARTPOLE,
    "test_call_sync_vector_env": CARTPOLE,
    "test_vector_env_wrapper_attributes": CARTPOLE,
}


def flat(env_id, **settings):
    """Make an environment whose observations are arrays."""
    return FlattenObservation(fetch_env.FetchEnv(env_id, **settings))


def pytest_configure(config):
    """Replace all environments that are registered, and choose the files."""
    files = GYMNASIUM if (config.rootpath / "tests/vector").is_dir() else ROBOTICS
    config.args[:] = [str(config.rootpath / file) for file in files]
    module = MODULES[files]
    sys.modules[module] = fetch_env
    gymnasium.registry.clear()
    for env_id in fetch_env.ENV_IDS:
        entry, settings = f"{module}:FetchEnv", {"env_id": env_id}
        gymnasium.register(
            env_id, entry, max_episode_steps=50, order_enforce=False, kwargs=settings
        )
    if files is GYMNASIUM:
        for name, env_id in IN_VECTORS.items():
            gymnasium.register(name, flat, max_episode_steps=50, kwargs={"env_id": env_id})


def pytest_collection_modifyitems(config, items):
    """Leave out what uses none of our environments, and mark what does not apply to them."""
    theirs = [item for item in items if not uses_ours(item)]
    config.hook.pytest_deselected(items=theirs)
    items[:] = [item for item in items if item not in theirs]
    for item in items:
        if reason := DOES_NOT_APPLY.get(item.originalname):
            item.add_marker(pytest.mark.xfail(reason=reason, strict=True))


def uses_ours(item):
    """Tell whether a test uses environments by name."""
    source = inspect.getsource(item.function)
    return "vector" not in item.path.parts or any(word in source for word in WORDS)
