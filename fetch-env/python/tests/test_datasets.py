"""Data sets, as Minari and OGBench read them."""

import json
import shutil
import signal
import subprocess
import sys
import time

import fetch_env
import gymnasium
import pytest

minari = pytest.importorskip("minari")

from episodes import (  # noqa: E402
    assert_is_the_environments_own,
    assert_ogbench_has,
    assert_same,
    assert_same_episode,
    seeds,
)

EPISODES = 12
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


def test_a_set_is_combined_with_a_users_own(dataset, folder):
    # As Minari's collector describes the environment of a user, which needs jax.
    spec = gymnasium.make(f"fetch_env/{ENV_IDS[dataset.id]}").spec
    name = f"{dataset.id[:-3]}-own-v0"
    shutil.copytree(folder / dataset.id, folder / name)
    path = folder / name / "data" / "metadata.json"
    metadata = json.loads(path.read_text())
    path.write_text(json.dumps({**metadata, "dataset_id": name, "env_spec": spec.to_json()}))
    combined = minari.combine_datasets([dataset, minari.load_dataset(name)], f"{name}-both-v0")
    assert combined.total_episodes == 2 * EPISODES
    assert combined.env_spec == spec == dataset.env_spec


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


def test_ogbench_loads_the_same_episodes(dataset, folder):
    assert_ogbench_has(dataset, folder / dataset.id.replace("/", "-"))


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
    (tmp_path / "fetch" / "file").touch()
    with pytest.raises(OSError, match="cannot be written"):
        write("random", tmp_path / "fetch" / "file", episodes=2)
    (tmp_path / "fetch" / "file").unlink()
    with pytest.raises(ValueError, match="from 0 to"):
        write("random", tmp_path, episodes=-1)
    # What failed has left nothing.
    assert [path.name for path in tmp_path.iterdir()] == ["fetch"]
    assert [path.name for path in tmp_path.rglob("*-v0")] == ["random-v0"]


def test_ctrl_c_leaves_nothing_of_the_data_set(tmp_path, ctrl_c):
    (tmp_path / "mine").touch()
    ctrl_c.start()
    with pytest.raises(KeyboardInterrupt):
        fetch_env.write_dataset("FetchPush-v4", "expert", tmp_path)
    assert list(tmp_path.rglob("*")) == [tmp_path / "mine"]


@pytest.mark.parametrize("data_format", ["minari", "ogbench"])
def test_a_full_disk_leaves_nothing_of_the_data_set(data_format, tmp_path):
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4_000, limits[1]))
    try:
        with pytest.raises(OSError, match="cannot be written"):
            fetch_env.write_dataset(
                "FetchPush-v4", "random", tmp_path / "sets", data_format, episodes=20
            )
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_process_leaves_is_removed(tmp_path):
    program = "import fetch_env, sys; fetch_env.write_dataset('FetchReach-v4', *sys.argv[1:])"
    child = subprocess.Popen([sys.executable, "-c", program, "random", tmp_path])  # noqa: S603
    while not any(tmp_path.rglob("part-0.arrow")):
        assert child.poll() is None
        time.sleep(0.01)
    child.terminate()
    assert child.wait() == -signal.SIGTERM
    assert [path.name[:10] for path in tmp_path.iterdir()] == [".random-v0"]
    (tmp_path / ".random-v0.mine").mkdir()
    fetch_env.write_dataset("FetchReach-v4", "random", tmp_path, episodes=1)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".random-v0.mine", "fetch"]
