"""Tasks in Python: the same everywhere, called once for all, and exceptions as they are."""

import copy
import gc
import json
import pickle
import runpy
import subprocess
import sys
from pathlib import Path

import fetch_env
import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

EXAMPLES = Path(__file__).parents[1] / "examples"
BLOCK = """
    <worldbody>
      <body name="block" pos="1.4 0.9 0.425">
        <joint type="free"/>
        <geom type="box" size="0.02 0.02 0.02" mass="1"/>
      </body>
    </worldbody>"""


class Meet:
    """Bring the object and a block of its own together, with the gripper above."""

    goal_len = 4
    extra_len = 3
    extension = {"xml": BLOCK, "object_mass": 0.5}  # noqa: RUF012

    def __init__(self):
        self.calls = {}

    def count(self, name, sim):
        self.calls.setdefault(name, []).append(len(sim.gripper()))

    def begin_episode(self, sim, rng):
        assert sim.position("block").shape == (3,)
        place = sim.position("object0") + np.append(rng.uniform(0.06, 0.1, 2), 0)
        sim.place("block", place, [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
        np.testing.assert_array_equal(sim.position("block"), place)
        return [0.0, 0.0, 0.0, rng.uniform(0.1, 0.2)]

    def achieved_goal(self, sim):
        self.count("achieved_goal", sim)
        apart = sim.position("object0") - sim.position("block")
        return np.hstack([apart, sim.gripper()[:, 2:] - 0.4])

    def observe_extra(self, sim):
        self.count("observe_extra", sim)
        turned = np.einsum("nij,nj->ni", sim.rotation("block"), sim.velocity("block"))
        return (
            turned + sim.angular_velocity("block") + sim.fingers()[:, :1] + sim.gripper_velocity()
        )

    def compute_reward(self, achieved_goal, desired_goal, info):  # noqa: ARG002
        return -np.linalg.norm(achieved_goal - desired_goal, axis=-1) * 2

    def is_success(self, achieved_goal, desired_goal):
        return np.abs(achieved_goal - desired_goal)[:, 3] < 0.1


ID = "fetch_env/FetchPush-v4"


def vector(num_envs=3, task=None, **settings):
    """Make environments, whose episodes have 5 steps."""
    settings = {"max_episode_steps": 5, **settings}
    return fetch_env.FetchVectorEnv("FetchPush-v4", num_envs, task=task or Meet(), **settings)


def trajectory(envs, steps=12):
    """Return all numbers of some steps."""
    actions = np.random.default_rng(0).uniform(-1, 1, (steps, envs.num_envs, 4)).astype("f4")
    numbers = [np.hstack([*envs.reset(seed=3)[0].values()])]
    for action in actions:
        observations, rewards, terminated, truncated, infos = envs.step(action)
        success = infos.get("is_success", infos.get("final_info", {}).get("is_success"))
        flags = [terminated, truncated] + ([] if success is None else [success])
        numbers.append(np.hstack([*observations.values(), rewards[:, None], np.stack(flags, 1)]))
    return numbers


@pytest.mark.parametrize(
    "variation",
    [None, {"observation_noise": 0.1, "achieved_goal_noise": 0.01}, {"observation_delay": 2}],
)
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_vectors_return_what_single_environments_do(mode, variation):
    settings = {"task": Meet(), "max_episode_steps": 5, "variation": variation}
    single = gymnasium.make_vec(ID, 3, "sync", vector_kwargs={"autoreset_mode": mode}, **settings)
    expected = trajectory(single)
    for num_threads in (1, 2):
        actual = trajectory(vector(num_threads=num_threads, autoreset_mode=mode, **settings))
        for ours, theirs in zip(actual, expected, strict=True):
            np.testing.assert_array_equal(ours[:, : theirs.shape[1]], theirs)


def test_methods_are_called_once_for_all_environments():
    envs = vector(4)
    task = envs.config_arguments()["task"]
    envs.reset(seed=0)
    task.calls.clear()
    for _ in range(8):
        envs.step(envs.action_space.sample())
    assert task.calls == {"achieved_goal": [4] * 8, "observe_extra": [4] * 8}


def test_the_reward_of_a_step_is_that_of_its_goals():
    envs = vector(autoreset_mode=AutoresetMode.DISABLED)
    envs.reset(seed=0)
    for _ in range(4):
        observations, rewards, _, _, infos = envs.step(envs.action_space.sample())
        goals = observations["achieved_goal"], observations["desired_goal"]
        np.testing.assert_array_equal(rewards, envs.compute_reward(*goals, {}))
        np.testing.assert_array_equal(infos["is_success"], Meet().is_success(*goals))
        assert envs.call("compute_reward", *(goal[0] for goal in goals), {})[0] == rewards[0]
    mask = np.array([True, False, False])
    after, _ = envs.reset(options={"reset_mask": mask})
    for key, rows in observations.items():
        np.testing.assert_array_equal(after[key][1:], rows[1:])


def test_states_are_restored():
    envs = vector()
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    other = pickle.loads(pickle.dumps(envs))
    state, actions = envs.get_state(), envs.action_space.sample()
    expected = envs.step(actions)
    observations = envs.set_state(state)
    assert observations["observation"].shape == (3, 28)
    for again in (envs.step(actions), other.step(actions)):
        np.testing.assert_equal(again[:2], expected[:2])
    env = copy.deepcopy(gymnasium.make(ID, task=Meet()).unwrapped)
    env.reset(seed=1)
    state, step = env.get_state(), env.step(actions[0])
    env.set_state(state)
    np.testing.assert_equal(env.step(actions[0]), step)


class BrokenError(Exception):
    """An exception of the user's."""


@pytest.mark.parametrize(
    "method", ["begin_episode", "achieved_goal", "observe_extra", "compute_reward", "is_success"]
)
@pytest.mark.parametrize("mode", [None, AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_exceptions_reach_the_caller_as_they_are(method, mode):
    task = Meet()
    env = gymnasium.make(ID, task=task).unwrapped if mode is None else None
    envs = env or vector(task=task, autoreset_mode=mode, num_threads=2)
    task = envs.config_arguments()["task"]
    actions = np.zeros((4,) if env else (3, 4), np.float32)
    envs.reset(seed=0)
    error = BrokenError(method)

    def broken(*_args):
        raise error

    setattr(task, method, broken)

    def use():
        for _ in range(7):
            envs.step(actions)
        envs.reset(seed=0)

    with pytest.raises(BrokenError) as caught:
        use()
    assert caught.value is error
    delattr(task, method)
    envs.reset(seed=0)
    envs.step(actions)


def test_an_unfinished_step_does_not_hold_the_interpreter():
    for _ in range(20):
        envs = vector(num_threads=2, max_episode_steps=1)
        envs.reset(seed=0)
        envs.step(envs.action_space.sample())
        envs.step_async(envs.action_space.sample())
        del envs
        gc.collect()


def refused(error, words, **members):
    """Make a task with other members, and use it."""
    task = Meet()
    for name, value in members.items():
        setattr(task, name, value)
    with pytest.raises(error, match=words):
        vector(task=task).reset(seed=0)


def test_mistakes_are_named():
    kept = []
    refused(
        ValueError,
        r"begin_episode\(\)'s goal has the shape \(2,\): pass \(4,\)",
        begin_episode=lambda _sim, _rng: [0, 0],
    )
    refused(
        ValueError,
        r"achieved_goal\(\) has the shape \(4,\): pass \(3, 4\)",
        achieved_goal=lambda _sim: np.zeros(4),
    )
    refused(
        ValueError,
        r"observe_extra\(\) returned NaN for environment 0",
        observe_extra=lambda _sim: np.full((3, 3), np.nan),
    )
    refused(
        ValueError,
        'there is no body "blok": the bodies are .*block',
        achieved_goal=lambda sim: sim.position("blok"),
    )
    refused(
        RuntimeError,
        r"placed in begin_episode\(\) alone",
        achieved_goal=lambda sim: sim.place("block", [1, 1, 1]),
    )
    refused(ValueError, "unknown field `mass`", extension={"mass": 1})
    refused(ValueError, "goals", goal_len=0)
    noise = {"variation": {"observation_noise": 0.1}}
    with pytest.raises(ValueError, match="called for each environment alone"):
        vector().reset(options=noise)
    vector(variation={"observation_noise": 0.0}).reset(options=noise)
    with pytest.raises(ValueError, match="leave out model"):
        vector(model="reference")
    envs = vector(task=None)
    envs.config_arguments()["task"].observe_extra = lambda sim: kept.append(sim) or np.zeros((3, 3))
    envs.reset(seed=0)
    with pytest.raises(RuntimeError, match="use sim in the method that got it"):
        kept[0].gripper()


def recorded(task):
    """Return environments, and a buffer of their random episodes."""
    envs = vector(8, task=task)
    buffer = fetch_env.HerBuffer(envs, 1000, seed=0)
    envs.reset(seed=0)
    buffer.record(envs)
    for _ in range(20):
        envs.step(envs.action_space.sample())
        buffer.record(envs)
    return envs, buffer


def test_buffers_relabel_with_the_reward_of_the_task():
    _, buffer = recorded(Meet())
    batch = pickle.loads(pickle.dumps(buffer)).sample(256)
    assert batch["observation"].shape == (256, 28)
    assert batch["relabeled"].any()
    goals = batch["next_achieved_goal"], batch["desired_goal"]
    np.testing.assert_allclose(batch["reward"], Meet().compute_reward(*goals, None), atol=1e-5)
    plain = fetch_env.FetchVectorEnv("FetchPush-v4", 8)
    plain.reset(seed=0)
    with pytest.raises(ValueError, match="another kind"):
        buffer.record(plain)


def test_mirrored_rows_are_mirror_images():
    class Mirrored(Meet):
        mirror = {"goal": "xyz.", "extra": "uvw"}  # noqa: RUF012

    envs, buffer = recorded(Mirrored())
    plain, mirrored = buffer.sample(256, seed=1), buffer.sample(256, seed=1, mirrored=1.0)
    across = 2 * envs.call("initial_gripper_xpos")[0][1] - plain["observation"][:, 1]
    np.testing.assert_allclose(mirrored["observation"][:, 1], across, atol=1e-6)
    turned = plain["observation"][:, 25:] * [-1, 1, -1]
    np.testing.assert_array_equal(mirrored["observation"][:, 25:], turned)
    for key in ("achieved_goal", "desired_goal", "next_achieved_goal"):
        np.testing.assert_array_equal(mirrored[key], plain[key] * [1, -1, 1, 1])
    np.testing.assert_array_equal(mirrored["reward"], plain["reward"])
    Mirrored.mirror = {"goal": "xyz.", "extra": "uv"}
    with pytest.raises(ValueError, match="extra has 2 letters: pass one for each of its 3"):
        vector(task=Mirrored())
    Mirrored.mirror = {"goal": "qqqq"}
    with pytest.raises(ValueError, match=r"task's mirror: there is no letter 'q': pass X, Y"):
        vector(task=Mirrored())


class Lift:
    """The object in the air: the settings' reward, and no extra elements."""

    goal_len = 3

    def begin_episode(self, sim, rng):
        return sim.position("object0") + np.array([0, 0, rng.uniform(0.1, 0.3)])

    def achieved_goal(self, sim):
        return sim.position("object0")


def test_the_settings_say_what_a_task_does_not():
    envs = fetch_env.FetchVectorEnv("FetchPickAndPlaceDense-v4", 2, task=Lift())
    observations, _ = envs.reset(seed=0)
    assert observations["observation"].shape == (2, 25)
    observations, rewards, *_ = envs.step(envs.action_space.sample())
    goals = observations["achieved_goal"], observations["desired_goal"]
    np.testing.assert_array_equal(rewards, envs.compute_reward(*goals))


def test_exceptions_end_learning_and_evaluation_as_they_are():
    settings = {"task": Lift(), "progress": False}
    training = fetch_env.train("FetchPickAndPlace-v4", steps=2000, target=None, **settings)
    result = fetch_env.evaluate("FetchPickAndPlace-v4", training.policy, 4, task=Lift())
    assert 0 <= result["success_rate"]["value"] <= 1

    class Failing(Lift):
        def is_success(self, *_goals):
            raise BrokenError

    for call in (
        lambda: fetch_env.train("FetchPickAndPlace-v4", task=Failing(), progress=False),
        lambda: fetch_env.evaluate("FetchPickAndPlace-v4", training.policy, 4, task=Failing()),
    ):
        with pytest.raises(BrokenError):
            call()


def test_a_run_in_a_folder_goes_on_with_the_same_bits(tmp_path):
    settings = {"target": None, "progress": False}
    short = fetch_env.train("FetchPickAndPlace-v4", steps=500, task=Lift(), **settings).settings
    short["schedule"] |= {"evaluation_interval": 500, "evaluation_episodes": 4}

    def train(folder, steps, task, **more):
        out = tmp_path / folder
        more |= settings if task is None else {"task": task, **settings}
        return fetch_env.train("FetchPickAndPlace-v4", short, steps=steps, out=out, **more)

    whole = train("whole", 1500, Lift())
    train("parts", 700, Lift())
    parts = train("parts", 1500, Lift(), resume=True)
    policies = [training.policy.weights() for training in (whole, parts)]
    np.testing.assert_equal(*policies)
    assert "Lift, learned in" in (tmp_path / "parts" / "page.html").read_text()
    train("started", 500, Lift(), start=whole.policy)
    description = json.loads((tmp_path / "started" / "run.json").read_text())
    assert f"{whole.policy.header['steps']} steps" in description["start"]
    with pytest.raises(ValueError, match="has the task Lift"):
        train("parts", 2000, Meet(), resume=True)
    with pytest.raises(ValueError, match="has the task Lift"):
        train("parts", 2000, None, resume=True)


def test_data_sets_have_the_episodes_of_the_task(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    settings = {"task": Meet(), "max_episode_steps": 5}

    def act(observation):
        return np.append(observation["achieved_goal"][:3], 0)

    for data_format in ("minari", "ogbench"):
        for policy, named in (("random", {}), (act, {"name": "mine"})):
            fetch_env.write_dataset(
                "FetchPush-v4", policy, tmp_path, data_format, episodes=3, **named, **settings
            )
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    env = gymnasium.make(ID, **settings)
    for name in ("random", "mine"):
        dataset = minari.load_dataset(f"fetch/meet/{name}-v0")
        assert dataset.observation_space == env.observation_space
        archive = np.load(tmp_path / f"fetch-meet-{name}-v0" / f"fetch-meet-{name}-v0-val.npz")
        for seed, episode in enumerate(dataset):
            states, rewards = [env.reset(seed=seed)[0]], []
            for action in episode.actions:
                if name == "mine":
                    np.testing.assert_array_equal(action, np.float32(act(states[-1])))
                state, reward, *_ = env.step(action)
                states.append(state)
                rewards.append(reward)
            for key, rows in episode.observations.items():
                np.testing.assert_array_equal(rows, [state[key] for state in states])
                if seed == 1:
                    stored = archive[key if key.endswith("s") else f"{key}s"]
                    np.testing.assert_array_equal(stored, rows)
            np.testing.assert_array_equal(episode.rewards, rewards)
        with pytest.raises(ValueError, match="cannot be recovered"):
            dataset.recover_environment()
    with pytest.raises(ValueError, match="the policy is for FetchPush-v4"):
        fetch_env.write_dataset("FetchPush-v4", "expert", tmp_path, episodes=2, **settings)


def test_exceptions_leave_no_data_set(tmp_path):
    class Failing(Meet):
        def compute_reward(self, *_):
            raise BrokenError

    with pytest.raises(BrokenError):
        fetch_env.write_dataset("FetchPush-v4", "random", tmp_path, episodes=2, task=Failing())
    assert list(tmp_path.iterdir()) == []


SCRIPT = """
import sys
sys.path.insert(0, {tests!r})
import fetch_env
from test_own_task import Lift, Meet
sys.exit(fetch_env.main({task}))
"""


def test_the_program_acts_in_the_task(tmp_path):
    def program(task, *words):
        script = SCRIPT.format(tests=str(Path(__file__).parent), task=task)
        command = [sys.executable, "-c", script, *words]
        return subprocess.run(  # noqa: S603
            command, cwd=tmp_path, capture_output=True, text=True, check=False
        )

    push = ("--env-id", "FetchPush-v4", "--policy", "zero")
    words = ("evaluate", *push, "--episodes", "2", "--threads", "1", "--json", "figures.json")
    done = program("Meet()", *words)
    assert done.returncode == 0, done.stderr
    figures = json.loads((tmp_path / "figures.json").read_text())["results"]
    figures = {figure["name"]: figure["value"] for figure in figures}

    def still(_observation):
        return np.zeros(4)

    expected = fetch_env.evaluate("FetchPush-v4", still, 2, task=Meet())
    name = "evaluate/FetchPush-v4/episode_return_mean"
    assert figures[name] == expected["episode_return_mean"]["value"]
    assert program("Meet()", "play", *push, "--out", "page.html").returncode == 0
    assert (tmp_path / "page.html").stat().st_size > 10_000
    collected = ("collect", *push, "--episodes", "2", "--format", "minari", "--out", "sets")
    assert program("Meet()", *collected).returncode == 0
    assert (tmp_path / "sets" / "fetch" / "meet" / "zero-v0").is_dir()
    refused = program("Meet()", "evaluate", "--env-id", "FetchPush-v4", "--episodes", "2")
    assert refused.returncode == 1
    assert "observation" in refused.stderr


def example(name):
    """Run an example's definitions."""
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_two_blocks_are_stacked_in_hindsight():
    buffer, mean = example("stack")["collect"](num_envs=4, steps=150)
    assert -2 <= mean < -1.5
    assert buffer.sample(1024)["reward"].mean() > mean + 0.5


def test_an_obstacle_is_learned():
    assert 0 <= example("obstacle")["learn"](steps=4000) <= 1


def test_its_goals_are_drawn_by_itself_alone():
    """The built-in tasks' goals are none of it."""
    env = fetch_env.FetchEnv("FetchPush-v4", task=Meet())
    env.reset(seed=0)
    with pytest.raises(ValueError, match="draws its goals in begin_episode"):
        env._sample_goal()  # noqa: SLF001


@pytest.mark.parametrize(
    "rotation", [np.zeros((3, 3)), np.diag([1, 1, -1]), np.full((3, 3), np.nan)]
)
def test_a_body_is_turned_by_a_rotation_matrix_alone(rotation):
    """A mirror is none."""

    class Turned(Meet):
        def begin_episode(self, sim, rng):  # noqa: ARG002
            sim.place("block", [1.3, 0.7, 0.5], rotation)

    with pytest.raises(ValueError, match="rotation is no rotation matrix"):
        fetch_env.FetchEnv("FetchPush-v4", task=Turned()).reset()
