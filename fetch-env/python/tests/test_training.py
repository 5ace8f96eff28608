"""Trainings: how they end, and what of them is kept."""

import contextlib
import importlib
import io
import json
import pickle
import signal
import sys
import threading
import warnings

import fetch_env
import numpy as np
import pytest


@pytest.fixture(scope="module")
def short():
    """Return settings with short cycles, updates and evaluations."""
    settings = fetch_env.train("FetchReach-v4", steps=0, progress=False).settings
    settings["schedule"].update(evaluation_episodes=10, evaluation_interval=200)
    settings["algorithm"]["ddpg"]["hidden"] = [32, 32]
    settings["replay"]["batch_size"] = 64
    return settings


def outcome(training):
    """Return the bits of a training, without the time that it took."""
    rows = json.loads(json.dumps(training.curve))
    for row in rows:
        del row["counters"]["seconds"]
    return rows, training.policy.__getstate__()


@pytest.mark.parametrize("env_id", ["FetchPush-v4", "FetchSlide-v4"])
def test_ctrl_c_returns_what_was_reached(env_id, ctrl_c):
    ctrl_c.start()
    training = fetch_env.train(env_id, target=None, progress=False)
    assert training.interrupted
    assert training.policy.header["steps"] < 2_000_000
    observation, _ = fetch_env.FetchEnv(env_id).reset(seed=0)
    assert training.policy(observation).shape == (4,)
    assert "interrupted" in repr(training)


def test_ctrl_c_ends_long_evaluations(ctrl_c):
    policy = fetch_env.Policy.shipped("FetchReach-v4")
    ctrl_c.start()
    with pytest.raises(KeyboardInterrupt):
        fetch_env.evaluate("FetchReach-v4", policy, 16, max_episode_steps=100_000)


def test_ctrl_c_in_the_middle_of_updates_returns_what_was_reached(short, ctrl_c):
    settings = json.loads(json.dumps(short))
    settings["schedule"]["updates_per_cycle"] = 10_000
    settings["algorithm"]["ddpg"]["hidden"] = [256, 256]
    ctrl_c.start()
    training = fetch_env.train("FetchReach-v4", settings, progress=False)
    assert training.interrupted
    assert training.policy.header["steps"] <= 400


def test_a_progress_function_stops_the_run(short):
    rows = []

    def stop(row):
        rows.append(row)
        return np.bool_(len(rows) < 2)

    training = fetch_env.train("FetchReach-v4", short, target=None, progress=stop)
    assert training.curve == rows
    assert len(rows) == 2
    assert not training.interrupted


def test_noise_is_that_of_the_actor_and_of_the_actions(short):
    noisy = json.loads(json.dumps(short))
    noisy["inputs"]["actor_observation_noise"] = 0.02
    run = {"env_id": "FetchReach-v4", "steps": 400, "target": None, "progress": False}
    variation = {"action_scale": 0.9}
    training = fetch_env.train(
        **run, preset=short, noise={"observation": 0.02, "action": 0.05}, variation=variation
    )
    expected = fetch_env.train(**run, preset=noisy, variation={**variation, "action_noise": 0.05})
    assert outcome(training) == outcome(expected)
    assert training.settings == noisy
    assert variation == {"action_scale": 0.9}
    with pytest.raises(ValueError, match="noise has the key 'object_pos': pass 'observation' or"):
        fetch_env.train(**run, noise={"object_pos": 0.02})
    with pytest.raises(ValueError, match="actor_observation_noise is -1"):
        fetch_env.train(**run, noise={"observation": -1.0})


def test_a_progress_function_sees_the_policy(short):
    policies = []

    def watch(row):
        policies.append(row.policy())
        kept.append(row)
        return len(policies) < 2

    kept = []
    training = fetch_env.train("FetchReach-v4", short, target=None, progress=watch)
    first, last = (policy.header["steps"] for policy in policies)
    assert first < last == training.policy.header["steps"]
    assert policies[1].__getstate__() == training.policy.__getstate__()
    assert pickle.loads(pickle.dumps(kept)) == training.curve
    with pytest.raises(RuntimeError, match="in the progress function"):
        kept[0].policy()


def test_an_exception_of_a_progress_function_keeps_what_was_reached(short, tmp_path):
    def fail(row):
        del row["success_rate"]
        message = "no"
        raise LookupError(message)

    with pytest.raises(LookupError, match="no") as caught:
        fetch_env.train("FetchReach-v4", short, target=None, progress=fail, out=tmp_path)
    training = caught.value.training
    assert "success_rate" in training.curve[0]
    assert training.policy.header["steps"] == training.curve[0]["counters"]["steps"]
    resumed = fetch_env.train(
        "FetchReach-v4", short, target=None, steps=0, out=tmp_path, resume=True
    )
    assert outcome(resumed) == outcome(training)


def test_a_resumed_run_ends_with_the_same_bits(short, tmp_path, ctrl_c):
    out = tmp_path / "new" / "run"

    def train(steps, progress=False, **arguments):  # noqa: FBT002
        return fetch_env.train(
            "FetchReach-v4", short, target=None, steps=steps, progress=progress, **arguments
        )

    stopped = train(10**9, lambda _: False, out=out)
    assert len(stopped.curve) == 1
    ctrl_c.start()
    interrupted = train(10**9, out=out, resume=True)
    assert interrupted.interrupted
    steps = interrupted.policy.header["steps"] + 400
    assert outcome(train(steps, out=out, resume=True)) == outcome(train(steps))
    names = sorted(path.name for path in out.iterdir())
    assert all(name.startswith("checkpoint-") for name in names[:2])
    assert names[2:] == ["curve.csv", "page.html", "policy.safetensors", "run.json", "run.lock"]
    written = fetch_env.Policy.load(out / "policy.safetensors").header
    assert written["success"]["episodes"] == 10
    assert written["steps"] == steps


def test_a_full_disk_keeps_what_was_reached(short, tmp_path, monkeypatch):
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    monkeypatch.chdir(tmp_path)

    def fill(_):
        monkeypatch.chdir("/")
        resource.setrlimit(resource.RLIMIT_FSIZE, (1_000, limits[1]))
        return False

    try:
        with pytest.raises(OSError, match="earlier checkpoints are intact") as caught:
            fetch_env.train("FetchReach-v4", short, target=None, progress=fill, out="run")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert caught.value.training.policy.header["steps"] > 0
    assert [path.name for path in tmp_path.rglob("*.zip")] == ["checkpoint-000000000000.zip"]


def test_a_folder_belongs_to_one_run(short, tmp_path):
    def train(settings=short, seed=1, **arguments):
        arguments = {"steps": 200, "out": tmp_path, "progress": False, **arguments}
        return fetch_env.train("FetchReach-v4", settings, seed=seed, **arguments)

    def contents():
        paths = [path for path in tmp_path.iterdir() if path.name != "run.lock"]
        return {path: path.read_bytes() for path in paths}

    train()
    before = contents()
    with pytest.raises(ValueError, match="pass resume=True, or choose another folder"):
        train()
    with pytest.raises(ValueError, match="has the seed 1"):
        train(seed=2, resume=True)
    with pytest.raises(ValueError, match="has other settings"):
        train("fast", resume=True)
    with pytest.raises(ValueError, match="has other settings of the environment"):
        train(resume=True, distance_threshold=0.1)
    with pytest.raises(ValueError, match="pass the folder of the run"):
        train(out=None, resume=True)
    with pytest.raises(OSError, match=r"cannot make .*test_training\.py/folder"):
        train(out=__file__ + "/folder")
    assert contents() == before


def test_a_folder_of_something_else_stays(short, tmp_path):
    (tmp_path / "curve.csv").write_text("the user's")
    for resume in (False, True):
        with pytest.raises(ValueError, match=r"no run\.json beside it.*choose another folder"):
            fetch_env.train("FetchReach-v4", short, steps=0, out=tmp_path, resume=resume)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["the user's"]


@pytest.mark.parametrize(
    "arguments",
    [
        {"target": 90},
        {"target": -0.1},
        {"target": float("nan")},
        {"target": True},
        {"target": "0.9"},
        {"steps": -5},
        {"steps": 1e6},
        {"steps": True},
        {"steps": 2**64},
        {"seed": -1},
        {"seed": False},
        {"num_threads": -1},
        {"num_threads": True},
        {"progress": "yes"},
        {"progress": 1},
        {"progress": None},
        {"resume": "yes"},
        {"out": 3},
    ],
)
def test_wrong_arguments_are_refused_before_anything_runs(arguments):
    with pytest.raises((TypeError, ValueError)):
        fetch_env.train("FetchReach-v4", **arguments)


class Terminal(io.StringIO):
    """Keeps what is written to a terminal."""

    def isatty(self):
        return True

    def screen(self):
        """Return its lines."""
        lines = self.getvalue().split("\n")
        return [line.split("\r")[-1].rstrip() for line in lines]


def in_threads(*calls):
    threads = [threading.Thread(target=call) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def test_progress_in_a_file_is_a_line_for_each_evaluation(short, monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())

    def train(seed):
        return fetch_env.train("FetchReach-v4", short, seed=seed, steps=1_000, target=None)

    curves = [train(1).curve, train(2).curve]
    in_threads(lambda: train(1), lambda: train(2))
    text = sys.stderr.getvalue()
    assert "\r" not in text
    lines = text.splitlines()
    assert len(lines) == 2 * sum(map(len, curves))
    assert sorted(lines[: len(lines) // 2]) == sorted(lines[len(lines) // 2 :])
    success = curves[0][-1]["success_rate"]["value"]
    assert f"seed 1 [{'#' * 30}] 1,000 of at most 1,000 steps, success rate {success:.2f}" in text


def test_one_of_two_trainings_has_the_line_of_the_terminal(short, monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setenv("COLUMNS", "120")
    inner = []

    def train(**arguments):
        return fetch_env.train("FetchReach-v4", short, steps=1_000, target=None, **arguments)

    outer = train(seed=1)
    assert len(sys.stderr.screen()) == 2
    assert "seed 1 [" in sys.stderr.screen()[0]
    # One begins after the other has, and ends before it.
    line = fetch_env.learn.Progress("other", 10)
    line.show(5, None)
    inner = train(seed=2)
    line.show(10, outer.curve[-1])
    line.close()
    lines = sys.stderr.screen()[1:]
    assert len(lines) == len(inner.curve) + 2
    assert all("seed 2 [" in text for text in lines[:-2])
    assert lines[-2].startswith("other [####")
    assert all(len(text) < 120 for text in lines)


@pytest.mark.parametrize("stream", ["none", "closed", "full", "bare"])
def test_progress_needs_no_standard_error(stream, short, monkeypatch):
    class Full(io.StringIO):
        def write(self, _):
            raise BrokenPipeError

    closed = io.StringIO()
    closed.close()
    streams = {"none": None, "closed": closed, "full": Full(), "bare": object()}
    monkeypatch.setattr(sys, "stderr", streams[stream])
    assert fetch_env.train("FetchReach-v4", short, steps=400).curve


def test_a_training_without_progress_is_silent(short, capfd):
    fetch_env.train("FetchReach-v4", short, steps=400, progress=False)
    assert capfd.readouterr() == ("", "")


def test_a_training_says_briefly_how_far_it_came(short):
    training = fetch_env.train("FetchReach-v4", short, seed=3, steps=400, progress=False)
    success = training.curve[-1]["success_rate"]["value"]
    text = f"<Training on FetchReach-v4, seed 3: 400 steps, success rate {success:.2f}>"
    assert repr(training) == text
    assert len(repr(fetch_env.train("FetchReach-v4", short, steps=0, progress=False))) < 60


def test_a_policy_that_cannot_be_saved_leaves_the_file_before(tmp_path):
    resource = pytest.importorskip("resource")
    path = tmp_path / "policy"
    policy = fetch_env.Policy.shipped("FetchReach-v4")
    policy.save(path)
    before = path.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000, limits[1]))
    try:
        with pytest.raises(OSError, match="policy"):
            fetch_env.Policy.shipped("FetchPush-v4").save(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_signals_stay_the_callers(short):
    class Stopped(Exception):  # noqa: N818
        pass

    def handler(*_):
        raise Stopped

    before = signal.signal(signal.SIGTERM, handler)
    timer = threading.Timer(0.5, signal.raise_signal, (signal.SIGTERM,))
    timer.start()
    try:
        with pytest.raises(Stopped) as caught:
            fetch_env.train("FetchPush-v4", target=None, progress=False)
        assert signal.getsignal(signal.SIGTERM) is handler
        assert caught.value.training.policy.header["env_id"] == "FetchPush-v4"
    finally:
        signal.signal(signal.SIGTERM, before)
    trained = []
    in_threads(lambda: trained.append(fetch_env.train("FetchReach-v4", short, steps=200)))
    assert not trained[0].interrupted


def test_the_package_is_reloaded_without_a_warning():
    error = io.StringIO()
    with warnings.catch_warnings(), contextlib.redirect_stderr(error):
        warnings.simplefilter("error")
        importlib.reload(fetch_env)
    assert error.getvalue() == ""


def test_a_run_starts_from_a_policy_which_a_resumed_one_does_not_need(short, tmp_path):
    def train(**arguments):
        return fetch_env.train("FetchReach-v4", short, seed=5, progress=False, **arguments)

    start = fetch_env.train("FetchReach-v4", short, steps=400, target=None, progress=False).policy
    begun = train(start=start, steps=0, out=tmp_path).policy
    seen = {"observation": np.ones(10), "achieved_goal": np.ones(3), "desired_goal": np.ones(3)}
    np.testing.assert_array_equal(begun(seen), start(seen))
    assert not np.array_equal(train(steps=0).policy(seen), start(seen))
    described = json.loads((tmp_path / "run.json").read_text())["start"]
    assert described == "FetchReach-v4, seed 0, 400 steps"
    resumed = train(steps=400, out=tmp_path, resume=True)
    assert outcome(resumed) == outcome(train(start=start, steps=400))
    with pytest.raises(ValueError, match="another policy to start from"):
        train(start=fetch_env.Policy.shipped("FetchPush-v4"), out=tmp_path, resume=True)
    with pytest.raises(ValueError, match=r"sizes of the layers are \[64, 64, 4\].* \[32, 32, 4\]"):
        train(start=fetch_env.Policy.shipped("FetchReach-v4"))
    with pytest.raises(TypeError, match=r"start is str: pass a fetch_env\.Policy"):
        train(start="policy.safetensors")
