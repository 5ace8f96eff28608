"""States that are saved, copied and pickled continue exactly."""

import copy
import pickle

import fetch_env
import gymnasium
import numpy as np
import pytest


def play(env, actions):
    """Return the observations and rewards of a few steps and of the next episode's start."""
    steps = [env.step(action)[:2] for action in actions]
    start = env.reset()[0]
    return [*(np.append(seen["observation"], reward) for seen, reward in steps), *start.values()]


@pytest.mark.parametrize(
    "again", [copy.copy, copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))]
)
def test_a_copy_goes_on_exactly(task_id, actions, again):
    env = gymnasium.make(f"fetch_env/{task_id}", distance_threshold=0.03)
    env.reset(seed=9)
    for action in actions[:20]:
        env.step(action)
    if again is copy.copy:
        other = gymnasium.wrappers.TimeLimit(copy.copy(env.unwrapped), 100)
        other._elapsed_steps = 20  # noqa: SLF001
    else:
        other = again(env)
    assert other.unwrapped.distance_threshold == 0.03
    for ours, theirs in zip(play(env, actions[20:50]), play(other, actions[20:50]), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_an_environment_without_an_episode_is_copied():
    env = copy.deepcopy(fetch_env.FetchEnv("FetchReach-v4", width=99))
    assert env.get_state() == fetch_env.FetchEnv("FetchReach-v4").get_state()
    assert env.reset(seed=0)[0] in env.observation_space


def test_a_state_is_restored_in_another_environment(task_id, actions):
    env, other = (fetch_env.FetchEnv(task_id) for _ in range(2))
    env.reset(seed=4)
    seen = [env.step(action)[0] for action in actions[:10]][-1]
    restored = other.set_state(env.get_state())
    assert all(np.array_equal(restored[key], seen[key]) for key in seen)
    for ours, theirs in zip(play(env, actions), play(other, actions), strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("state", [b"", b"{}", b"\xff", b'{"sim":1}'])
def test_what_is_no_state_changes_nothing(push, state):
    before = push.get_state()
    with pytest.raises(ValueError, match="state"):
        push.set_state(state)
    assert push.get_state() == before


def test_a_state_of_another_task_is_refused(push):
    reach = fetch_env.FetchEnv("FetchReach-v4")
    reach.reset(seed=0)
    with pytest.raises(ValueError, match="from Reach, this is Push"):
        push.set_state(reach.get_state())
