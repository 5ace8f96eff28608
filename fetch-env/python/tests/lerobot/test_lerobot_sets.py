"""Data sets that LeRobot writes, as LeRobot loads them."""

import fetch_env
import gymnasium
import numpy as np
import pytest

pytest.importorskip("lerobot.envs")

from fetch_env import lerobot

pytestmark = pytest.mark.filterwarnings("default")

NAME = "test/fetch"


def column(dataset, name):
    return np.stack([row.numpy() for row in dataset.hf_dataset.with_format("torch")[name]])


def replayed(env_id, actions, seeds):
    """Return what episodes with these seeds and actions give."""
    env = gymnasium.make(f"fetch_env/{env_id}")
    rows = []
    for seed, episode in zip(seeds, actions, strict=True):
        observation, _ = env.reset(seed=seed)
        for action in episode:
            after, reward, _, truncated, info = env.step(action)
            rows.append((observation, reward, info["is_success"], truncated))
            observation = after
    return rows


def test_the_rows_are_the_environments_own(task_id, tmp_path):
    dataset = lerobot.record(task_id, "scripted", NAME, 2, root=tmp_path / "set", seed=7)
    assert (dataset.num_episodes, dataset.num_frames, dataset.fps) == (2, 100, 25)
    actions = column(dataset, "action")
    rows = replayed(task_id, actions.reshape(2, 50, 4), [7, 8])
    names = dataset.features["observation.environment_state"]["names"]
    for index, (observation, reward, success, truncated) in enumerate(rows):
        frame = dataset[index]
        state = frame["observation.state"].numpy()
        surroundings = frame["observation.environment_state"].numpy()
        numbers = observation["observation"].astype(np.float32)
        # All numbers of the observation, each in one of the two.
        split = (state, surroundings[:-3])
        assert np.array_equal(np.sort(np.concatenate(split)), np.sort(numbers))
        assert np.array_equal(state[:3], numbers[:3])
        assert np.array_equal(surroundings[-3:], observation["desired_goal"].astype(np.float32))
        if "Reach" not in task_id:
            place = names.index("object_x")
            achieved = observation["achieved_goal"].astype(np.float32)
            assert np.array_equal(surroundings[place : place + 3], achieved)
        assert frame["next.reward"] == np.float32(reward)
        assert bool(frame["next.success"]) == bool(success)
        assert bool(frame["next.done"]) == truncated
        assert frame["timestamp"] == np.float32(index % 50 / 25)
        assert frame["task"].endswith("target.")


def test_names_are_the_policies_of_data_sets(tmp_path):
    minari = pytest.importorskip("minari")
    for policy in ("random", "expert-noisy", "mixed"):
        dataset = lerobot.record("FetchPush-v4", policy, NAME, 4, root=tmp_path / policy)
        fetch_env.write_dataset("FetchPush-v4", policy, tmp_path / "minari", episodes=4)
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
            theirs = minari.load_dataset(f"fetch/push/{policy}-v0")
        expected = np.concatenate([episode.actions for episode in theirs])
        assert np.array_equal(column(dataset, "action"), expected)


def test_policies_and_functions_act(tmp_path):
    policy = fetch_env.Policy.shipped("FetchReach-v4")
    ours = lerobot.record("FetchReach-v4", policy, NAME, 1, root=tmp_path / "policy")
    named = lerobot.record("FetchReach-v4", "expert", NAME, 1, root=tmp_path / "named")
    assert np.array_equal(column(ours, "action"), column(named, "action"))
    up = lerobot.record("FetchReach-v4", lambda _: [0, 0, 2, 0], NAME, 1, root=tmp_path / "up")
    assert np.array_equal(column(up, "action"), np.tile([0, 0, 1, 0], (50, 1)))


@pytest.mark.parametrize("use_videos", [True, False])
def test_pictures_show_the_state(tmp_path, use_videos):
    size = {"width": 96, "height": 64}
    dataset = lerobot.record(
        "FetchPush-v4",
        "expert",
        NAME,
        1,
        root=tmp_path / "set",
        pixels=True,
        use_videos=use_videos,
        **size,
    )
    assert "observation.environment_state" not in dataset.features
    dataset = type(dataset)(NAME, root=tmp_path / "set", video_backend="pyav")
    env = gymnasium.make("fetch_env/FetchPush-v4", render_mode="rgb_array", **size)
    env.reset(seed=0)
    for index in range(50):
        frame = dataset[index]
        found = frame["observation.image"].numpy().transpose(1, 2, 0) * 255
        difference = np.abs(found - env.render())
        # A video is compressed with losses.
        assert difference.mean() < (8 if use_videos else 1e-4)
        env.step(frame["action"].numpy())


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_nothing_is_left_of_a_failed_recording(tmp_path, error):
    calls = []

    def policy(_):
        calls.append(0)
        if len(calls) > 70:
            raise error
        return [0, 0, 0, 0]

    with pytest.raises(error):
        lerobot.record("FetchReach-v4", policy, NAME, 2, root=tmp_path / "set")
    assert list(tmp_path.iterdir()) == []


def test_what_exists_stays(tmp_path):
    (tmp_path / "thesis.txt").write_text("a thesis")
    with pytest.raises(FileExistsError, match="choose another place"):
        lerobot.record("FetchReach-v4", "random", NAME, 1, root=tmp_path)
    assert (tmp_path / "thesis.txt").read_text() == "a thesis"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("FetchReach-v4", "best", NAME, 1), "choose from random, scripted"),
        (("FetchReach-v4", "random", NAME, 0), "at least 1"),
        (("FetchRaech-v4", "random", NAME, 1), "FetchReach-v4"),
    ],
)
def test_errors_say_what_to_do(tmp_path, arguments, message):
    with pytest.raises(ValueError, match=message):
        lerobot.record(*arguments, root=tmp_path / "set")
    assert list(tmp_path.iterdir()) == []
