"""Data sets, as Minari and OGBench read them."""

import importlib
import sys
import types

import fetch_env
import numpy as np
import pytest

minari = pytest.importorskip("minari")

EPISODES = 12
KEYS = ("observation", "achieved_goal", "desired_goal")
ENV_IDS = {
    "fetch/push/mixed-v0": "FetchPush-v4",
    "fetch/reach-dense/mixed-v0": "FetchReachDense-v4",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a set of each format and two tasks, which Minari looks into."""
    folder = tmp_path_factory.mktemp("datasets")
    for env_id in ENV_IDS.values():
        for data_format in ("minari", "ogbench"):
            fetch_env.write_dataset(env_id, "mixed", folder, data_format, episodes=EPISODES, seed=5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MINARI_DATASETS_PATH", str(folder))
        yield folder


@pytest.fixture(params=ENV_IDS)
def dataset(request, folder):
    """Return each data set in turn."""
    assert (folder / request.param).is_dir()
    return minari.load_dataset(request.param)


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
    """Check that the seed and the actions of an episode give it again."""
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


def test_each_episode_is_the_recovered_environments_own(dataset):
    env = dataset.recover_environment()
    assert env.spec.id == f"fetch_env/{ENV_IDS[dataset.id]}"
    assert dataset.observation_space == env.observation_space
    assert dataset.action_space == env.action_space
    assert seeds(dataset) == list(range(5, 5 + EPISODES))
    assert dataset.total_steps == EPISODES * 50
    for seed, episode in zip(seeds(dataset), dataset, strict=True):
        assert_is_the_environments_own(env, seed, episode)


@pytest.mark.parametrize("policy", ["random", "scripted", "expert", "expert-noisy"])
def test_each_set_is_the_environments_own(policy, tmp_path, monkeypatch):
    fetch_env.write_dataset("FetchPush-v4", policy, tmp_path, episodes=3, seed=1)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    dataset = minari.load_dataset(f"fetch/push/{policy}-v0")
    env = dataset.recover_environment()
    assert len(set(seeds(dataset))) == 3
    for seed, episode in zip(seeds(dataset), dataset, strict=True):
        assert_is_the_environments_own(env, seed, episode)


def test_the_reference_is_the_environment_for_evaluation(dataset):
    pytest.importorskip("gymnasium_robotics")
    env = dataset.recover_environment(eval_env=True)
    own = dataset.recover_environment()
    assert env.spec.id == ENV_IDS[dataset.id]
    assert env.spec.max_episode_steps == own.spec.max_episode_steps
    observation, _ = env.reset(seed=5)
    assert env.observation_space.contains(observation)
    assert env.observation_space == own.observation_space
    env.step(env.action_space.sample())


def test_sets_are_sampled_filtered_and_combined(dataset):
    episodes = list(dataset)
    dataset.set_seed(0)
    for episode in dataset.sample_episodes(5):
        assert_same_episode(episode, episodes[episode.id])
    late = dataset.filter_episodes(lambda episode: episode.id >= 9)
    assert [episode.id for episode in late] == [9, 10, 11]
    combined = minari.combine_datasets([dataset, dataset], f"{dataset.id[:-3]}-twice-v0")
    assert combined.total_episodes == 2 * EPISODES
    for left, right in zip(combined, episodes + episodes, strict=True):
        assert_same_episode(left, right)


def test_an_episode_goes_on_from_each_of_its_snapshots(tmp_path, monkeypatch):
    fetch_env.write_dataset("FetchPush-v4", "expert-noisy", tmp_path, episodes=1, snapshots=True)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    dataset = minari.load_dataset("fetch/push/expert-noisy-v0")
    env = dataset.recover_environment().unwrapped
    episode = dataset[0]
    env.reset()
    for t, snapshot in enumerate(episode.infos["snapshot"]):
        observation = env.set_state(bytes(snapshot))
        assert_same(observation["observation"], episode.observations["observation"][t])
        for later in range(t, min(t + 3, 50)):
            observation = env.step(episode.actions[later])[0]
            assert_same(observation["observation"], episode.observations["observation"][later + 1])


def test_sets_are_listed(folder):
    assert (folder / "fetch").is_dir()
    listed = minari.list_local_datasets()
    assert {"fetch/push/mixed-v0", "fetch/reach-dense/mixed-v0"} <= listed.keys()
    assert "FetchPush-v4" in listed["fetch/push/mixed-v0"]["description"]


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


def test_ogbench_loads_the_same_episodes(dataset, folder):
    utils = ogbench_utils()
    name = dataset.id.replace("/", "-")
    episodes = list(dataset)
    validation = [1, 11]
    parts = {
        f"{name}.npz": [episodes[i] for i in range(EPISODES) if i not in validation],
        f"{name}-val.npz": [episodes[i] for i in validation],
    }
    for file, part in parts.items():
        path = folder / name / file
        loaded = utils.load_dataset(path, ob_dtype=np.float64, add_info=True)
        states = [episode.observations["observation"] for episode in part]
        assert_same(loaded["observations"], np.concatenate([rows[:-1] for rows in states]))
        assert_same(loaded["next_observations"], np.concatenate([rows[1:] for rows in states]))
        assert_same(loaded["actions"], np.concatenate([episode.actions for episode in part]))
        for key in ("qpos", "qvel"):
            rows = [episode.infos[key][:-1] for episode in part]
            assert_same(loaded[key], np.concatenate(rows))
        ends = np.flatnonzero(loaded["terminals"])
        assert_same(ends, np.arange(1, len(part) + 1) * 50 - 1)
        compact = utils.load_dataset(path, compact_dataset=True)
        assert_same(compact["observations"], np.concatenate(states).astype(np.float32))
        assert compact["valids"].sum() == 50 * len(part)
        with np.load(path) as arrays:
            assert_same(arrays["seeds"], np.array([5 + episode.id for episode in part], np.uint64))
            for key in ("achieved_goal", "desired_goal"):
                rows = [episode.observations[key] for episode in part]
                assert_same(arrays[f"{key}s"], np.concatenate(rows))
            rewards = [np.append(episode.rewards, 0.0) for episode in part]
            assert_same(arrays["rewards"], np.concatenate(rewards))


@pytest.mark.parametrize("data_format", ["minari", "ogbench"])
def test_a_seed_decides_all_bytes(data_format, tmp_path):
    contents = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        summary = fetch_env.write_dataset(
            "FetchSlide-v4", "expert-noisy", folder, data_format, episodes=3
        )
        assert 0.0 <= summary["success_rate"]["value"] <= 1.0
        paths = sorted(path for path in folder.rglob("*") if path.is_file())
        contents.append([(path.relative_to(folder), path.read_bytes()) for path in paths])
    assert contents[0] == contents[1]


def test_what_cannot_be_written_is_an_error(tmp_path):
    def write(*arguments, **settings):
        fetch_env.write_dataset("FetchReach-v4", *arguments, **settings)

    write("random", tmp_path, episodes=2)
    with pytest.raises(ValueError, match="exists already"):
        write("random", tmp_path, episodes=2)
    with pytest.raises(ValueError, match="choose from random, scripted"):
        write("best", tmp_path)
    with pytest.raises(ValueError, match="choose from minari, ogbench"):
        write("random", tmp_path, "csv")
    with pytest.raises(ValueError, match="only the format minari has snapshots"):
        write("random", tmp_path, "ogbench", snapshots=True)
    with pytest.raises(ValueError, match="does not have the settings of FetchReach-v4"):
        write("random", tmp_path / "other", distance_threshold=0.01)
    with pytest.raises(ValueError, match="needs at least 2"):
        write("random", tmp_path, "ogbench", episodes=1)
    # What failed has left nothing.
    assert [path.name for path in tmp_path.iterdir()] == ["fetch"]
