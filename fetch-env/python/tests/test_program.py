"""The program ``fetch-env`` that the package brings, and runs that it shares with Python."""

import contextlib
import json
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import fetch_env
import pytest

MODULE = [sys.executable, "-m", "fetch_env"]
SCRIPT = [str(Path(sysconfig.get_path("scripts")) / "fetch-env")]

#: A run of small networks. Without a target, it takes all steps.
SHORT = (
    "train --env-id FetchReach-v4 --target 2 --threads 1 --set hidden=[32,32] --set batch_size=64 "
    "--set evaluation_episodes=10"
)
#: What is left in a folder after its end, besides checkpoints.
FILES = ["curve.csv", "page.html", "policy.safetensors", "run.json", "run.lock"]


@pytest.fixture(scope="module")
def short():
    """Return the settings of the same run."""
    settings = fetch_env.train("FetchReach-v4", steps=0, progress=False).settings
    settings["schedule"]["evaluation_episodes"] = 10
    settings["algorithm"]["ddpg"]["hidden"] = [32, 32]
    settings["replay"]["batch_size"] = 64
    return settings


@pytest.fixture
def train(short, tmp_path):
    """Return a function that trains in Python as the program does, in a folder below."""

    def in_folder(name, steps, **arguments):
        arguments = {"target": None, "progress": False, "num_threads": 1, **arguments}
        return fetch_env.train(
            "FetchReach-v4", short, steps=steps, out=tmp_path / name, **arguments
        )

    return in_folder


def program(folder, *arguments, command=MODULE):
    """Run the program in a folder."""
    words = [*command, *map(str, arguments)]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603


@contextlib.contextmanager
def started(folder, *arguments):
    """Start the program in a folder, as a shell does in the foreground."""
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        words = [*MODULE, *map(str, arguments)]
        run = subprocess.Popen(  # noqa: S603
            words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
    finally:
        signal.signal(signal.SIGINT, before)
    with run:
        yield run
        run.kill()


def wait_for(run, condition):
    """Wait until there is something, or the program has ended."""
    while run.poll() is None and not condition():
        time.sleep(0.001)


def bits(folder):
    """Return the results of a run, without the time that it took."""
    lines = (folder / "curve.csv").read_text().splitlines()
    seconds = lines[0].split(",").index("seconds")
    rows = [line.split(",") for line in lines]
    policy = (folder / "policy.safetensors").read_bytes()
    return [row[:seconds] + row[seconds + 1 :] for row in rows], policy


def names(folder):
    return sorted(path.name for path in folder.iterdir() if path.suffix != ".zip")


@pytest.mark.parametrize("command", [MODULE, SCRIPT], ids=["module", "script"])
def test_it_is_a_module_and_a_script(tmp_path, command):
    shown = program(tmp_path, "--help", command=command)
    assert (shown.returncode, shown.stderr) == (0, "")
    assert "Usage: fetch-env <COMMAND>" in shown.stdout
    wrong = program(tmp_path, "train", "--env-id", "FetchPish-v4", command=command)
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert "FetchPush-v4" in wrong.stderr
    assert "Traceback" not in wrong.stderr
    failed = program(tmp_path, "train", "--resume", "no", command=command)
    assert failed.returncode == 1
    assert failed.stderr.startswith("error: no is not the folder of a run")
    assert list(tmp_path.iterdir()) == []


def test_it_runs_on_the_mujoco_of_the_package(tmp_path):
    seen = program(tmp_path, "doctor")
    assert seen.returncode == 0
    path = fetch_env.library_path()
    assert f"MuJoCo 3.6.0, headers and library; {path} (the program brings it)" in seen.stdout
    assert "FAIL" not in seen.stdout


def test_its_runs_are_those_of_python(tmp_path, train):
    ended = program(tmp_path, *SHORT.split(), "--steps", 600, "--out", "program")
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.startswith("train: FetchReach-v4, seed 0: 600 steps")
    training = train("python", 600)
    folders = [tmp_path / name for name in ("program", "python")]
    assert bits(folders[0]) == bits(folders[1])
    assert [names(folder) for folder in folders] == [FILES, FILES]
    described = [json.loads((folder / "run.json").read_text()) for folder in folders]
    for description in described:
        description["changes"].sort()
    assert described[0] == described[1]
    training.save(tmp_path / "saved.safetensors")
    same = [tmp_path / "saved.safetensors", folders[0] / "policy.safetensors"]
    words = ["evaluate", "--env-id", "FetchReach-v4", "--episodes", 5, "--policy"]
    tables = [program(tmp_path, *words, path).stdout for path in same]
    assert tables[0] == tables[1].replace(str(same[1]), str(same[0]))
    assert "FetchReach-v4" in tables[0]


def test_ctrl_c_stops_a_run_that_either_continues(tmp_path, train):
    train("whole", 1_000)
    for name in ("program", "python"):
        out = tmp_path / name
        with started(tmp_path, *SHORT.split(), "--steps", 1_000, "--out", name) as run:
            wait_for(run, (out / "curve.csv").exists)
            run.send_signal(signal.SIGINT)
            _, errors = run.communicate()
        assert run.returncode == 130, errors
        assert errors.startswith("train: stopped by SIGINT after ")
        assert names(out) == ["curve.csv", "run.json", "run.lock"]
        assert list(out.glob("checkpoint-*.zip"))
        if name == "python":
            train(name, 1_000, resume=True)
        else:
            resumed = program(tmp_path, "train", "--resume", name)
            assert resumed.returncode == 0, resumed.stderr
        assert bits(out) == bits(tmp_path / "whole")


def test_it_continues_what_python_began(tmp_path, train, ctrl_c):
    train("whole", 1_000, distance_threshold=0.1)
    settings = {"distance_threshold": 0.1, "progress": lambda _: False}
    stopped = train("run", 1_000, **settings)
    assert len(stopped.curve) == 1
    # Again, in the middle of a cycle.
    ctrl_c.start()
    train("run", 10**9, **{**settings, "progress": False}, resume=True)
    assert names(tmp_path / "run") == ["curve.csv", "run.json", "run.lock"]
    steps = max(1_000, train("run", 0, **settings, resume=True).policy.header["steps"] + 200)
    resumed = program(tmp_path, "train", "--resume", "run", "--steps", steps)
    assert resumed.returncode == 0, resumed.stderr
    train("whole", steps, distance_threshold=0.1, resume=True)
    assert bits(tmp_path / "run") == bits(tmp_path / "whole")


def test_one_run_at_a_time_has_a_folder(tmp_path, train):
    refused = []

    def watch(_):
        with pytest.raises(
            ValueError, match="is using the folder: wait until it has ended"
        ) as caught:
            train("run", 400, resume=True)
        refused.append(caught.value)
        second = program(tmp_path, "train", "--resume", "run")
        assert second.returncode == 1
        assert "is using the folder" in second.stderr
        return False

    train("run", 10**9, progress=watch)
    assert len(refused) == 1
    train("run", 0, resume=True)


def is_caught(process):
    """Return whether a process has a handler for Ctrl-C."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    caught = next(line for line in status.splitlines() if line.startswith("SigCgt:"))
    return bool(int(caught.split()[1], 16) & 1 << (signal.SIGINT - 1))


def test_ctrl_c_ends_other_commands_at_once(tmp_path):
    words = ["evaluate", "--env-id", "FetchPush-v4", "--policy", "random", "--episodes", 10**6]
    with started(tmp_path, *words) as run:
        wait_for(run, lambda: is_caught(run))
        # The program has taken Python's handler away.
        wait_for(run, lambda: not is_caught(run))
        run.send_signal(signal.SIGINT)
        _, errors = run.communicate()
    assert run.returncode == -signal.SIGINT
    assert "Traceback" not in errors


def test_a_reader_that_has_seen_enough_is_no_error(tmp_path):
    with started(tmp_path, "completions", "zsh") as run:
        run.stdout.close()
        assert run.stderr.read() == ""
    assert run.wait() == 0


def test_a_closed_output_is_no_file_of_the_program(tmp_path):
    words = " ".join([*MODULE, SHORT, "--steps", "0", "--out", "run"])
    ended = subprocess.run(["sh", "-c", f"{words} >&-"], cwd=tmp_path, check=False)  # noqa: S603, S607
    assert ended.returncode == 0
    assert len((tmp_path / "run" / "run.lock").read_text().splitlines()) == 2
