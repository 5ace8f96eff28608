"""Checks that the tests of data sets share, of episodes as Minari reads them."""

import importlib
import sys
import types

import numpy as np
import pytest

KEYS = ("observation", "achieved_goal", "desired_goal")


def seeds(dataset):
    """Return the seed of each episode."""
    return [
        metadata["seed"]
        for metadata in dataset.storage.get_episode_metadata(dataset.episode_indices)
    ]


def assert_same(left, right):
    """Check that two arrays have the same bits."""
    left, right = np.asarray(left), np.asarray(right)
    assert (left.dtype, left.shape) == (right.dtype, right.shape)
    assert left.tobytes() == right.tobytes()


def assert_same_episode(left, right):
    """Check that two episodes of Minari have the same bits."""
    for key in KEYS:
        assert_same(left.observations[key], right.observations[key])
    for name in ("actions", "rewards", "terminations", "truncations"):
        assert_same(getattr(left, name), getattr(right, name))
    assert left.infos.keys() == right.infos.keys()
    for name, values in left.infos.items():
        assert_same(values, right.infos[name])


def assert_is_the_environments_own(env, seed, episode):
    """Check that the seed and the actions of an episode reproduce it."""
    assert len(episode) == 50
    observation, _ = env.reset(seed=seed)
    states = [observation]
    physics = [np.concatenate([env.unwrapped.data.qpos, env.unwrapped.data.qvel])]
    rewards, ends, successes = [], [], []
    for action in episode.actions:
        observation, reward, terminated, truncated, info = env.step(action)
        states.append(observation)
        physics.append(np.concatenate([env.unwrapped.data.qpos, env.unwrapped.data.qvel]))
        rewards.append(reward)
        ends.append((terminated, truncated))
        successes.append(info["is_success"])
    for key in KEYS:
        assert_same(episode.observations[key], [state[key] for state in states])
    assert_same(episode.rewards, rewards)
    assert_same(np.stack([episode.terminations, episode.truncations], axis=1), ends)
    infos = episode.infos
    assert_same(infos["is_success"][1:, 0], np.array(successes, np.float32))
    assert_same(np.concatenate([infos["qpos"], infos["qvel"]], axis=1), physics)
    assert_same(infos["dense_reward"], -infos["distance"])
    kind = "dense_reward" if "Dense" in env.spec.id else "sparse_reward"
    assert_same(infos[kind][1:, 0], episode.rewards)


def ogbench_utils():
    """Import OGBench's loader without its environments, which need more packages."""
    if "ogbench.utils" in sys.modules:
        return sys.modules["ogbench.utils"]
    spec = importlib.util.find_spec("ogbench")
    if spec is None:
        pytest.skip("OGBench is not installed")
    package = types.ModuleType("ogbench")
    package.__path__ = list(spec.submodule_search_locations)
    sys.modules["ogbench"] = package
    return importlib.import_module("ogbench.utils")


def assert_ogbench_has(dataset, folder):
    """Check that OGBench loads Minari's episodes, the second of every ten for validation."""
    utils = ogbench_utils()
    episodes, numbers = list(dataset), seeds(dataset)
    parts = {
        ".npz": [number for number in range(len(episodes)) if number % 10 != 1],
        "-val.npz": [number for number in range(len(episodes)) if number % 10 == 1],
    }
    for ending, part in parts.items():
        path = folder / f"{folder.name}{ending}"
        loaded = utils.load_dataset(path, ob_dtype=np.float64, add_info=True)
        states = [episodes[number].observations["observation"] for number in part]
        assert_same(loaded["observations"], np.concatenate([rows[:-1] for rows in states]))
        assert_same(loaded["next_observations"], np.concatenate([rows[1:] for rows in states]))
        assert_same(loaded["actions"], np.concatenate([episodes[n].actions for n in part]))
        for key in ("qpos", "qvel"):
            assert_same(loaded[key], np.concatenate([episodes[n].infos[key][:-1] for n in part]))
        ends = np.flatnonzero(loaded["terminals"])
        assert_same(ends, np.arange(1, len(part) + 1) * 50 - 1)
        compact = utils.load_dataset(path, compact_dataset=True)
        assert_same(compact["observations"], np.concatenate(states).astype(np.float32))
        assert compact["valids"].sum() == 50 * len(part)
        with np.load(path) as arrays:
            assert_same(arrays["seeds"], np.array([numbers[n] for n in part], np.uint64))
            for key in ("achieved_goal", "desired_goal"):
                rows = [episodes[n].observations[key] for n in part]
                assert_same(arrays[f"{key}s"], np.concatenate(rows))
            rewards = [np.append(episodes[n].rewards, 0.0) for n in part]
            assert_same(arrays["rewards"], np.concatenate(rewards))
