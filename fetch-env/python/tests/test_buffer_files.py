"""What leaves a buffer and what comes into it as a whole: files, archives and other buffers."""

import copy
import pickle
import threading

import fetch_env
import numpy as np
import pytest
from buffers import STEPS, Stored, flat

SETTINGS = {
    "fields": {"log_prob": 1, "hidden": 2},
    "priorities": {"unit": "transition", "new_priority": {"given": 2.0}},
    "motionless_episodes": {"max_distance": 0.001, "kept": 0.5, "seed": 3},
}


@pytest.fixture(scope="module")
def stored():
    return Stored()


def draw(buffer, **settings):
    batch = buffer.sample(64, seed=1, **settings)
    return {key: batch[key].tobytes() for key in sorted(batch)}


def through_file(buffer, make, folder):
    buffer.save(folder / "buffer")
    again = make()
    again.load(folder / "buffer")
    return again


@pytest.mark.parametrize("how", ["file", "pickle", "copy"])
def test_a_buffer_comes_back_with_fields_and_priorities(stored, tmp_path, how):
    buffer = stored.buffer(**SETTINGS)
    buffer.set_priorities([1, 2, 3], [8.0, 0.0, 5.0])
    if how == "file":
        again = through_file(buffer, lambda: stored.buffer(**SETTINGS, fill=False), tmp_path)
    elif how == "pickle":
        again = pickle.loads(pickle.dumps(buffer))
    else:
        again = copy.deepcopy(buffer)
    drawn = draw(buffer, priorities=0.5)
    assert "fields_hidden" in drawn
    assert draw(again, priorities=0.5) == drawn
    assert [again.priority(number) for number in (1, 2, 3, 4)] == [8.0, 0.0, 5.0, 2.0]


@pytest.mark.parametrize("name", SETTINGS)
def test_a_file_of_other_settings_is_refused(stored, tmp_path, name):
    stored.buffer(**SETTINGS).save(tmp_path / "buffer")
    other = stored.buffer(**{**SETTINGS, name: None})
    before = draw(other)
    with pytest.raises(ValueError, match=f"the file has {name}=.*, the buffer has .*made with the"):
        other.load(tmp_path / "buffer")
    assert draw(other) == before


def test_an_archive_has_the_episodes_and_gives_them_back(stored, tmp_path):
    buffer = stored.buffer(fields=SETTINGS["fields"])
    buffer.export_npz(tmp_path / "episodes.npz")
    data = np.load(tmp_path / "episodes.npz")
    start = 0
    for number, episode in enumerate(stored.episodes):
        steps = data["episode_lengths"][number]
        states = slice(start + number, start + number + steps + 1)
        steps = slice(start, start + steps)
        np.testing.assert_array_equal(data["observations"][states], episode["observation"])
        np.testing.assert_array_equal(data["achieved_goals"][states], episode["achieved_goal"])
        np.testing.assert_array_equal(data["desired_goals"][number], episode["desired_goal"])
        np.testing.assert_array_equal(data["actions"][steps], episode["action"])
        np.testing.assert_array_equal(data["rewards"][steps], episode["reward"])
        np.testing.assert_array_equal(data["fields_hidden"][steps], stored.field(2)[steps])
        start = steps.stop
    again = stored.buffer(fields=SETTINGS["fields"], fill=False)
    assert again.import_npz(tmp_path / "episodes.npz") == len(stored.episodes)
    assert draw(again) == draw(buffer)
    with pytest.raises(ValueError, match="no array `fields_other`"):
        stored.buffer(fields={"other": 1}).import_npz(tmp_path / "episodes.npz")


@pytest.mark.parametrize("name", ["import_npz", "import_minari", "import_ogbench"])
def test_a_missing_file_is_named(stored, tmp_path, name):
    with pytest.raises(FileNotFoundError) as raised:
        getattr(stored.buffer(), name)(tmp_path / "none")
    assert raised.value.filename == str(tmp_path / "none")


@pytest.mark.parametrize("data_format", ["minari", "ogbench"])
def test_data_sets_are_taken_with_their_rewards(tmp_path, data_format):
    env_id = "FetchPush-v4"
    fetch_env.write_dataset(env_id, "scripted", tmp_path, data_format, episodes=3, seed=5)
    name = "fetch-push-scripted-v0"
    path = {
        "minari": tmp_path / "fetch" / "push" / "scripted-v0",
        "ogbench": tmp_path / name / f"{name}.npz",
    }[data_format]
    env = fetch_env.FetchEnv(env_id)
    buffer = fetch_env.HerBuffer(env, 1000)
    # OGBench keeps some for validation.
    episodes = 3 if data_format == "minari" else 2
    assert getattr(buffer, f"import_{data_format}")(path) == buffer.num_episodes == episodes
    assert len(buffer) == episodes * STEPS
    batch = buffer.sample(4096, k=0.0, seed=0)
    first, _ = env.reset(seed=5)
    start = batch["transition"] == 1
    assert start.any()
    for part, numbers in first.items():
        expected = np.tile(numbers.astype(np.float32), (start.sum(), 1))
        np.testing.assert_array_equal(batch[part][start], expected)
    goals = batch["next_achieved_goal"], batch["desired_goal"]
    np.testing.assert_array_equal(batch["reward"], env.compute_reward(*goals))
    if data_format == "ogbench":
        own = fetch_env.HerBuffer(env, 1000, reward=flat)
        own.import_ogbench(path)
        batch = own.sample(256, k=0.0, seed=0)
        goals = batch["next_achieved_goal"], batch["desired_goal"]
        np.testing.assert_allclose(batch["reward"], flat(*goals, range(256)), rtol=1e-6)
        failing = fetch_env.HerBuffer(env, 1000, reward=lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            failing.import_ogbench(path)
        assert failing.num_episodes == 0


def test_a_buffer_takes_the_episodes_of_another(stored):
    buffer, other = stored.buffer(), stored.buffer()
    buffer.append(other)
    assert buffer.num_episodes == 2 * len(stored.episodes)
    drawn = buffer.sample(2000, seed=0, k=0.0)
    at = (drawn["transition"] - 1) % len(other)
    assert (drawn["transition"] > len(other)).any()
    np.testing.assert_array_equal(drawn["observation"], stored.observation[at])
    for wrong, error, message in (
        (buffer, ValueError, "other is this buffer itself"),
        (stored.buffer(reward=flat), ValueError, "keep them apart"),
        (stored.buffer(fields={"more": 1}), ValueError, "no field .more."),
        (stored.env, TypeError, "other is FetchEnv: pass a fetch_env.HerBuffer"),
    ):
        with pytest.raises(error, match=message):
            buffer.append(wrong)


def test_two_buffers_that_take_each_others_episodes_do_not_hang(stored):
    one, two = stored.buffer(), stored.buffer()
    pairs = ((one, two), (two, one)) * 2

    def append(buffer, other):
        for _ in range(200):
            buffer.append(other)

    threads = [threading.Thread(target=append, args=pair, daemon=True) for pair in pairs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
        assert not thread.is_alive()
