"""MuJoCo's warnings are Python's."""

import json
import warnings
from pathlib import Path

import fetch_env
import numpy as np
import pytest

STILL = np.zeros(4, np.float32)


def make_unstable(envs):
    """Change the state so that the physics fails from there."""
    whole = json.loads(envs.get_state())
    states = [state["env"]["env"] for state in whole] if isinstance(whole, list) else [whole]
    for state in states:
        state["simulator"]["qvel"][-1] = 1e9
    envs.set_state(json.dumps(whole).encode())


def test_a_warning_comes_before_the_error(push):
    make_unstable(push)
    with (
        pytest.warns(fetch_env.MujocoWarning, match="QACC") as caught,
        pytest.raises(fetch_env.SimulationError, match="unstable"),
    ):
        push.step(STILL)
    assert {warning.filename for warning in caught} == {__file__}
    assert not Path("MUJOCO_LOG.TXT").exists()
    # Nothing is left to warn of.
    push.reset(seed=0)
    push.step(STILL)


def test_an_error_of_the_simulation_is_not_replaced(push):
    make_unstable(push)
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    envs.reset(seed=0)
    make_unstable(envs)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(fetch_env.SimulationError):
            push.step(STILL)
        with pytest.raises(fetch_env.SimulationError, match="environment 0"):
            envs.step(np.stack([STILL] * 2))


@pytest.mark.parametrize("num_threads", [1, 2])
def test_threads_warn_where_the_step_was_called(num_threads):
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2, num_threads=num_threads)
    envs.reset(seed=0)
    make_unstable(envs)
    with (
        pytest.warns(fetch_env.MujocoWarning, match="QACC") as caught,
        pytest.raises(fetch_env.SimulationError, match="environment 0"),
    ):
        envs.step(np.stack([STILL] * 2))
    assert len(caught) == 2
