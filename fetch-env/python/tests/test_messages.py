"""What errors say: nothing of Rust or of the package's inside, and what Python's errors say."""

import errno
import multiprocessing
import re
import subprocess
import sys

import fetch_env
import numpy as np
import pytest
from buffers import Stored

VALUES = (None, -1, 0, 10**30, 1.5, 1e300, float("nan"), "up", b"x", [], [1, 2], {}, np.zeros(3))
#: Words of Rust, names inside the package, and numbers with all their digits.
FOREIGN = re.compile(
    r"::|\{ |Some\(|Err\(|borrow|unwrap\b|__new__|_native|config_arguments|\d{20}|os error|usize"
)
GOALS = np.zeros((2, 3))


def message_of(call):
    """Return the message of the error of a call, if there is one."""
    try:
        call()
    except Exception as error:  # noqa: BLE001
        return str(error)
    return None


def wrong_calls(value):
    """Return calls that take a value in each place, most of them wrongly."""
    push = {"env_id": "FetchPush-v4"}
    env = fetch_env.FetchEnv(**push)
    env.reset(seed=0)
    envs = fetch_env.FetchVectorEnv(**push, num_envs=2)
    envs.reset(seed=0)
    policy = fetch_env.Policy.shipped("FetchPush-v4")
    buffer = fetch_env.HerBuffer(env, 100)
    step = {"reward": 0.0, "terminated": False, "truncated": False}
    settings = fetch_env.Settings.__annotations__
    yield lambda: fetch_env.FetchEnv(value)
    for name in (*settings, "width", "height"):
        yield lambda name=name: fetch_env.FetchEnv(**push, **{name: value})
    for name in ("num_envs", "num_threads", "max_episode_steps"):
        yield lambda name=name: fetch_env.FetchVectorEnv(**push, **{name: value})
    for each in (env, envs):
        yield lambda each=each: each.reset(seed=value)
        yield lambda each=each: each.reset(options=value)
        for name in ("desired_goal", "object_position", "goal"):
            yield lambda each=each, name=name: each.reset(options={name: value})
        yield lambda each=each: each.step(value)
        yield lambda each=each: each.set_state(value)
        yield lambda each=each: each.compute_reward(value, GOALS)
        yield lambda each=each: each.compute_terminated(GOALS, value)
    for name in ("goal", "distance_threshold", "reward_type", "obj_range", "target_offset"):
        yield lambda name=name: setattr(env, name, value)
    yield lambda: envs.step_async(value)
    yield lambda: envs.set_attr("goal", value)
    yield lambda: fetch_env.HerBuffer(envs, value)
    yield lambda: fetch_env.HerBuffer(value, 100)
    yield lambda: buffer.record(value)
    yield lambda: buffer.begin_episode(value)
    yield lambda: buffer.add_step(np.zeros(4), value, **step)
    yield lambda: buffer.unfinished_steps(env_index=value)
    yield lambda: fetch_env.Policy.shipped(value)
    yield lambda: policy(value)
    for name in ("policy", "episodes", "seed", "num_threads"):
        arguments = {**push, "policy": policy, "episodes": 1, name: value}
        yield lambda arguments=arguments: fetch_env.evaluate(**arguments)
    for name in ("preset", "seed", "num_threads"):
        arguments = {**push, "steps": 1, "target": 7.0, name: value}
        yield lambda arguments=arguments: fetch_env.train(**arguments)
    for name in ("set", "format", "episodes", "seed"):
        arguments = {**push, "set": "random", "folder": "/nowhere/set", name: value}
        yield lambda arguments=arguments: fetch_env.write_dataset(**arguments)


def wrong_draws(value):
    """Return calls that take a value as a setting of a buffer or a draw, most of them wrongly."""
    env = fetch_env.FetchEnv("FetchPush-v4")
    settings = {"fields": {"value": 1}, "priorities": {"unit": "episode"}}
    buffer = Stored(env).buffer(**settings)
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 1)
    envs.reset()
    for name in ("batch_size", "strategy", "k", "seed", *fetch_env.Sampling.__annotations__):
        yield lambda name=name: buffer.sample(**{"batch_size": 2, name: value})
        yield lambda name=name: buffer.sample(**{"batch_size": 2, name: {name: value}})
    for name in ("n_step", "goal_noise"):
        for key in ("steps", "gamma", "radius", "share"):
            yield lambda name=name, key=key: buffer.sample(2, **{name: {key: value}})
    yield lambda: buffer.sample(2, goals=[{"strategy": value, "weight": value}])
    yield lambda: buffer.sample(2, strategy={"geometric": value})
    yield lambda: buffer.sample(2, strategy={"future": value})
    for name in ("reward", "terminated", "fields", "priorities", "motionless_episodes"):
        for each in (value, {"unit": value}, {"unit": "episode", "new_priority": value}):
            yield lambda name=name, each=each: fetch_env.HerBuffer(env, 100, **{name: each})
    yield lambda: buffer.set_priorities(value, [1.0])
    yield lambda: buffer.set_priorities([1], value)
    yield lambda: buffer.priority(value)
    yield lambda: buffer.append(value)
    yield lambda: buffer.record(envs, fields=value)
    for name in ("load", "import_npz", "import_minari", "import_ogbench"):
        yield lambda name=name: getattr(buffer, name)(value)


@pytest.mark.parametrize("calls", [wrong_calls, wrong_draws])
@pytest.mark.parametrize("value", VALUES, ids=repr)
def test_wrong_calls_speak_of_what_was_passed(value, calls):
    messages = [message for call in calls(value) if (message := message_of(call)) is not None]
    assert len(messages) > 15
    for message in messages:
        assert message
        assert not FOREIGN.search(message), message


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda env: env.compute_reward("up", GOALS), "achieved_goal"),
        (lambda env: env.compute_reward(GOALS, [None] * 3), "desired_goal"),
        (lambda env: env.step([1j] * 4), "action"),
        (lambda env: env.reset(options={"desired_goal": [[1.0], [2.0, 3.0]]}), "desired_goal"),
    ],
)
def test_an_array_is_named(push, call, name):
    with pytest.raises((TypeError, ValueError), match=f"^{name}: "):
        call(push)


def test_numbers_are_not_written_out():
    with pytest.raises(ValueError, match="target_range is 1e300: pass"):
        fetch_env.FetchEnv("FetchPush-v4", target_range=1e300)
    with pytest.raises(ValueError, match=r"100000000000000000\.\.\. is out of range"):
        fetch_env.FetchEnv("FetchPush-v4", n_substeps=10**40)
    with pytest.raises(ValueError, match="a long number is out of range"):
        fetch_env.FetchEnv("FetchPush-v4", n_substeps=10**5000)


def test_files_are_named_with_the_systems_number(tmp_path):
    policy = fetch_env.Policy.shipped("FetchPush-v4")
    buffer = fetch_env.HerBuffer(fetch_env.FetchEnv("FetchPush-v4"), 100)
    (tmp_path / "file").write_bytes(b"")
    missing, below = tmp_path / "no" / "file", tmp_path / "file" / "file"
    for call in (policy.save, policy.load, buffer.save, buffer.load):
        for path, number, kind in (
            (missing, errno.ENOENT, FileNotFoundError),
            (below, errno.ENOTDIR, NotADirectoryError),
        ):
            with pytest.raises(kind) as raised:
                call(path)
            assert raised.value.errno == number
            assert raised.value.filename == str(path)
    with pytest.raises(FileNotFoundError, match="download_reference_model") as raised:
        fetch_env.FetchEnv("FetchPush-v4", model=missing)
    assert raised.value.errno == errno.ENOENT
    assert raised.value.filename == str(missing / "push.xml")


MAKES_TOO_MANY = """
import resource, sys, fetch_env
fetch_env.FetchVectorEnv("FetchPush-v4", 2)
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, [used + int(sys.argv[1]) * 2**20] * 2)
try:
    fetch_env.FetchVectorEnv("FetchPush-v4", 65_536)
except MemoryError as error:
    print(error)
"""

#: In a process of its own, too: a heap that was this large keeps its addresses, and Linux does not
#: fork a process that has more of them than the machine has memory.
IS_STOPPED = """
import signal, threading, fetch_env
signal.signal(signal.SIGINT, signal.default_int_handler)
threading.Timer(0.5, signal.raise_signal, [signal.SIGINT]).start()
try:
    fetch_env.FetchVectorEnv("FetchPush-v4", 20_000)
except KeyboardInterrupt:
    print("stopped")
"""


def said_by(program, *arguments):
    """Return what a program in Python prints."""
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout  # noqa: S603


@pytest.mark.parametrize("megabytes", ["60", "200", "700"])
def test_too_many_environments_for_the_memory_say_so(megabytes):
    assert "make fewer environments" in said_by(MAKES_TOO_MANY, megabytes)


def test_ctrl_c_ends_the_making_of_many():
    assert said_by(IS_STOPPED) == "stopped\n"


def errors_in_child(queue, envs, drawn):
    """Report the errors of what a forked process cannot use."""
    for call in (envs.reset, drawn.render):
        queue.put(message_of(call))


def test_forked_processes_are_told_of_spawn():
    context = multiprocessing.get_context("fork")
    queue = context.SimpleQueue()
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    drawn = fetch_env.FetchEnv("FetchPush-v4", render_mode="rgb_array", width=32, height=32)
    drawn.reset(seed=0)
    drawn.render()
    child = context.Process(target=errors_in_child, args=(queue, envs, drawn))
    child.start()
    for _ in range(2):
        assert 'context="spawn"' in queue.get()
    child.join()
