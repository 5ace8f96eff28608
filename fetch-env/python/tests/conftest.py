"""Fixtures that the tests share."""

import signal
import threading

import fetch_env
import gymnasium
import numpy as np
import pytest

TASKS = [env_id for env_id in fetch_env.ENV_IDS if "Dense" not in env_id]


@pytest.fixture(params=fetch_env.ENV_IDS)
def env_id(request):
    """Return the name of each environment in turn."""
    return request.param


@pytest.fixture(params=TASKS)
def task_id(request):
    """Return the name of each environment with sparse rewards in turn."""
    return request.param


@pytest.fixture
def push():
    """Return an environment in which an episode has begun."""
    env = fetch_env.FetchEnv("FetchPush-v4")
    env.reset(seed=0)
    return env


@pytest.fixture
def actions():
    """Return random actions for an episode and a few steps more."""
    return np.random.default_rng(1).uniform(-1.2, 1.2, (60, 4)).astype(np.float32)


@pytest.fixture
def ctrl_c():
    """Return a timer that presses Ctrl-C soon after it has been started."""
    # Processes in the background of a shell ignore it.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield threading.Timer(0.5, signal.raise_signal, (signal.SIGINT,))
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session")
def reference():
    """Return a function that makes the real environments, if they are installed."""
    robotics = pytest.importorskip("gymnasium_robotics")
    gymnasium.register_envs(robotics)
    if not fetch_env.has_reference_model():
        fetch_env.download_reference_model()
    return gymnasium.make
