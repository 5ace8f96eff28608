"""Several threads on one object, and forks in the middle of their calls."""

import os
import signal
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor

import fetch_env
import gymnasium
import numpy as np
import pytest


def vector(num_envs=2):
    """Return environments in which episodes have begun, and a buffer with their start."""
    envs = fetch_env.FetchVectorEnv("FetchReach-v4", num_envs, num_threads=1)
    buffer = fetch_env.HerBuffer(envs, 10_000)
    envs.reset(seed=0)
    buffer.record(envs)
    return envs, buffer


def collect(envs, buffer, actions, steps=150):
    """Record steps."""
    for step in range(steps):
        envs.step(actions[step % 59 : step % 59 + 2])
        buffer.record(envs)


def test_one_thread_records_while_others_sample(actions):
    envs, buffer = vector()
    collect(envs, buffer, actions, 51)
    done = threading.Event()

    def learn():
        rows = 0
        while not done.is_set():
            batch = buffer.sample(512)
            rewards = envs.compute_reward(batch["next_achieved_goal"], batch["desired_goal"])
            np.testing.assert_array_equal(batch["reward"], rewards)
            assert 1 <= buffer.num_episodes <= len(buffer)
            rows += 512
        return rows

    with ThreadPoolExecutor(2) as threads:
        learners = [threads.submit(learn) for _ in range(2)]
        try:
            collect(envs, buffer, actions)
        finally:
            done.set()
        assert all(learner.result() for learner in learners)
    # The threads have changed nothing.
    other_envs, alone = vector()
    collect(other_envs, alone, actions, 51)
    collect(other_envs, alone, actions)
    for key, numbers in buffer.sample(64, seed=1).items():
        np.testing.assert_array_equal(numbers, alone.sample(64, seed=1)[key])


@pytest.mark.parametrize("num_envs", [None, 2])
def test_steps_of_several_threads_follow_each_other(num_envs):
    def make():
        if num_envs is None:
            return fetch_env.FetchEnv("FetchPush-v4")
        return fetch_env.FetchVectorEnv("FetchPush-v4", num_envs)

    action = np.full((4,) if num_envs is None else (num_envs, 4), 0.5, np.float32)
    shared, alone = make(), make()
    for envs in (shared, alone):
        envs.reset(seed=0)
    with ThreadPoolExecutor(4) as threads:
        results = list(threads.map(lambda _: shared.step(action), range(16)))
    expected = [alone.step(action) for _ in range(16)]
    seen = sorted(result[0]["observation"].tobytes() for result in results)
    assert seen == sorted(result[0]["observation"].tobytes() for result in expected)
    assert shared.get_state() == alone.get_state()


@pytest.mark.parametrize("num_envs", [None, 4])
def test_closing_waits_for_the_step(num_envs):
    if num_envs is None:
        envs = fetch_env.FetchEnv("FetchPush-v4", n_substeps=1000)
        action = np.zeros(4, np.float32)
    else:
        envs = fetch_env.FetchVectorEnv("FetchPush-v4", num_envs, n_substeps=500)
        action = np.zeros((num_envs, 4), np.float32)
    envs.reset(seed=0)
    begun = threading.Event()

    def steps():
        while True:
            begun.set()
            envs.step(action)

    with ThreadPoolExecutor(1) as threads:
        stepping = threads.submit(steps)
        begun.wait()
        envs.close()
        with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="closed"):
            stepping.result()


def test_a_policy_and_a_training_are_shared(push):
    observation = push.reset(seed=0)[0]
    policy = fetch_env.Policy.shipped("FetchPush-v4")
    with ThreadPoolExecutor(4) as threads:
        actions = list(threads.map(lambda _: policy(observation).tobytes(), range(64)))
    assert set(actions) == {policy(observation).tobytes()}


def in_child(call):
    """Return whether a forked process ends the call, and does not wait forever."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # there are threads
        child = os.fork()
    if child == 0:
        signal.alarm(20)
        try:
            call()
        except RuntimeError as error:
            os._exit("forked" not in str(error))
        os._exit(0)
    return os.waitpid(child, 0)[1] == 0


def test_a_fork_in_the_middle_of_calls_hangs_no_child(actions):
    envs, buffer = vector()
    collect(envs, buffer, actions, 51)
    env = fetch_env.FetchEnv("FetchReach-v4")
    env.reset(seed=0)
    done = threading.Event()

    def use(call):
        while not done.is_set():
            call()

    with ThreadPoolExecutor(3) as threads:
        for call in (lambda: buffer.sample(4096), lambda: env.step(actions[0])):
            threads.submit(use, call)
        threads.submit(use, lambda: buffer.sample(4096))
        try:
            for _ in range(8):
                assert in_child(lambda: len(buffer))
                assert in_child(lambda: env.step(actions[0]))
                assert in_child(envs.get_state)
        finally:
            done.set()
    # The parent goes on.
    assert len(buffer) == 100


def test_what_was_free_is_usable_in_a_child(actions):
    envs, buffer = vector()
    collect(envs, buffer, actions, 51)
    batch = buffer.sample(8, seed=1)["action"].tobytes()
    with ThreadPoolExecutor(1) as threads:
        threads.submit(buffer.sample, 8).result()

        def call():
            if buffer.sample(8, seed=1)["action"].tobytes() != batch:
                os._exit(2)

        assert in_child(call)
