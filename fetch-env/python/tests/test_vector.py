"""Many environments: the same bits as one by one, and Gymnasium's infos."""

import copy
import multiprocessing
import pickle
import threading

import fetch_env
import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from reference import assert_same_info, assert_same_observation

NUM_ENVS = 3
MODES = list(AutoresetMode)


def assert_same_step(ours, theirs):
    assert_same_observation(ours[0], theirs[0])
    for one, another in zip(ours[1:4], theirs[1:4], strict=True):
        assert one.dtype == another.dtype
        np.testing.assert_array_equal(one, another)
    assert_same_info(ours[4], theirs[4])


def assert_same_vectors(ours, theirs, mode, *, seed=3, steps=105):
    """Step two vectors, whose environments end at different times."""
    assert_same_observation(ours.reset(seed=seed)[0], theirs.reset(seed=seed)[0])
    random = np.random.default_rng(5)
    ended = np.zeros(NUM_ENVS, bool)
    for step in range(steps):
        if step == 20 or (mode is AutoresetMode.DISABLED and ended.any()):
            mask = ended if ended.any() else np.array([False, True, False])
            starts = [
                envs.reset(seed=seeds, options={"reset_mask": mask.copy()})
                for envs in (ours, theirs)
                for seeds in [[None, 8, None] if step == 20 else None]
            ]
            assert_same_observation(starts[0][0], starts[1][0])
            assert starts[0][1] == starts[1][1] == {}
        actions = random.uniform(-1.5, 1.5, (NUM_ENVS, 4)).astype(np.float32)
        results = ours.step(actions), theirs.step(actions)
        assert_same_step(*results)
        ended = results[0][2] | results[0][3]
    assert ours.np_random_seed == theirs.np_random_seed
    for one, another in zip(ours.np_random, theirs.np_random, strict=True):
        assert one.bit_generator.state == another.bit_generator.state


@pytest.mark.parametrize("mode", MODES)
def test_vectors_have_the_bits_of_the_reference(reference, task_id, mode):
    ours = fetch_env.FetchVectorEnv(task_id, NUM_ENVS, autoreset_mode=mode, model="reference")
    theirs = SyncVectorEnv([lambda: reference(task_id)] * NUM_ENVS, autoreset_mode=mode)
    assert_same_vectors(ours, theirs, mode)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("num_threads", [1, 2, 3])
def test_vectors_have_the_bits_of_single_environments(mode, num_threads):
    ours = fetch_env.FetchVectorEnv(
        "FetchPushDense-v4", NUM_ENVS, autoreset_mode=mode, num_threads=num_threads
    )
    assert ours.num_threads == num_threads
    single = [lambda: gymnasium.make("fetch_env/FetchPushDense-v4")] * NUM_ENVS
    assert_same_vectors(ours, SyncVectorEnv(single, autoreset_mode=mode), mode)


def test_gymnasium_makes_the_vector(env_id):
    envs = gymnasium.make_vec(f"fetch_env/{env_id}", num_envs=2)
    assert isinstance(envs.unwrapped, fetch_env.FetchVectorEnv)
    assert envs.metadata["autoreset_mode"] is envs.autoreset_mode is AutoresetMode.NEXT_STEP
    sync = gymnasium.make_vec(f"fetch_env/{env_id}", num_envs=2, vectorization_mode="sync")
    for name in ("action_space", "observation_space", "single_action_space"):
        assert getattr(envs, name) == getattr(sync, name)
    observations, infos = envs.reset(seed=1)
    assert observations in envs.observation_space
    assert infos == {}
    rewards = envs.step(envs.action_space.sample())[1]
    assert rewards.dtype == np.float64
    limited = gymnasium.make_vec(f"fetch_env/{env_id}", num_envs=2, max_episode_steps=2)
    limited.reset(seed=0)
    ends = [limited.step(limited.action_space.sample())[3].tolist() for _ in range(3)]
    assert ends == [[False] * 2, [True] * 2, [False] * 2]


def test_asynchronous_steps_are_in_the_order_of_the_environments(actions):
    ours, theirs = (fetch_env.FetchVectorEnv("FetchPush-v4", 4, num_threads=2) for _ in range(2))
    ours.reset(seed=0)
    theirs.reset(seed=0)
    for step in range(0, 60, 4):
        batch = actions[step : step + 4]
        ours.step_async(batch)
        with pytest.raises(RuntimeError, match="step_wait"):
            ours.step(batch)
        assert_same_step(ours.step_wait(), theirs.step(batch))
    with pytest.raises(RuntimeError, match="step_async"):
        ours.step_wait()


@pytest.mark.parametrize("again", [copy.deepcopy, lambda envs: pickle.loads(pickle.dumps(envs))])
def test_copies_go_on_exactly(actions, again):
    envs = fetch_env.FetchVectorEnv("FetchSlide-v4", 2, autoreset_mode="SameStep")
    envs.reset(seed=0)
    for step in range(30):
        envs.step(actions[step : step + 2])
    other = again(envs)
    for step in range(30, 58):
        assert_same_step(envs.step(actions[step : step + 2]), other.step(actions[step : step + 2]))


def test_rows_that_a_reset_leaves_out_show_the_restored_state(actions):
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2, autoreset_mode="Disabled")
    fresh = envs.get_state()
    envs.reset(seed=0)
    observation = envs.step(actions[:2])[0]
    other = copy.deepcopy(envs)
    state = envs.get_state()
    envs.step(actions[2:4])
    assert_same_observation(envs.set_state(state), observation)
    reset = {"options": {"reset_mask": np.array([True, False])}}
    rows = [each.reset(**reset)[0] for each in (envs, other)]
    assert_same_observation(*rows)
    for key, numbers in observation.items():
        np.testing.assert_array_equal(rows[0][key][1], numbers[1])
    assert all(np.isnan(numbers).all() for numbers in envs.set_state(fresh).values())


def test_a_state_is_restored(actions):
    envs = fetch_env.FetchVectorEnv("FetchPickAndPlace-v4", 2)
    envs.reset(seed=0)
    envs.step(actions[:2])
    state = envs.get_state()
    later = [envs.step(actions[step : step + 2]) for step in range(2, 40)]
    envs.set_state(state)
    for step, seen in enumerate(later, 2):
        assert_same_step(envs.step(actions[step : step + 2]), seen)
    with pytest.raises(ValueError, match="2"):
        fetch_env.FetchVectorEnv("FetchPickAndPlace-v4", 3).set_state(state)


def test_what_is_called_by_name():
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    observations, _ = envs.reset(seed=[5, 9])
    goals = envs.get_attr("goal")
    np.testing.assert_array_equal(np.stack(goals), observations["desired_goal"])
    assert envs.np_random_seed == envs.get_attr("np_random_seed") == (5, 9)
    assert envs.get_attr("distance_threshold") == (0.05, 0.05)
    rewards = envs.call("compute_reward", observations["achieved_goal"], np.stack(goals), {})
    assert [reward.tolist() for reward in rewards] == [[-1.0, -1.0]] * 2
    assert envs.get_attr("action_space") == (envs.single_action_space,) * 2
    for name in ("nonsense", "reset", "step", "close", "get_state", "call", "_native"):
        with pytest.raises(AttributeError, match=name):
            envs.call(name)
    with pytest.raises(AttributeError, match="make the environments with it"):
        envs.set_attr("distance_threshold", 0.1)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        (np.zeros((3, 4), np.float32), r"\[3, 4\]: pass \[2, 4\]"),
        (np.zeros(8, np.float32), r"pass \[2, 4\]"),
        ([[0.0] * 4, [0.0, 0.0, float("nan"), 0.0]], r"environment 1: action\[2\] is NaN"),
    ],
)
def test_actions_that_mean_nothing_change_nothing(actions, message):
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    envs.reset(seed=0)
    before = envs.get_state()
    with pytest.raises(ValueError, match=message):
        envs.step(actions)
    assert envs.get_state() == before


@pytest.mark.parametrize(
    ("reset", "error", "message"),
    [
        ({"seed": [1]}, ValueError, "1 elements for 2 environments"),
        ({"seed": -1}, ValueError, "from 0 to"),
        ({"options": {"reset_mask": [True, False]}}, TypeError, "booleans"),
        ({"options": {"reset_mask": np.zeros(2, bool)}}, ValueError, "no environment"),
        ({"options": {"reset_mask": np.ones(3, bool)}}, ValueError, r"\(3,\)"),
        ({"options": {"mask": 1}}, ValueError, "desired_goal"),
    ],
)
def test_resets_that_mean_nothing(reset, error, message):
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    with pytest.raises(error, match=message):
        envs.reset(**reset)


def test_vectors_at_the_wrong_time():
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    actions = np.zeros((2, 4), np.float32)
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.step(actions)
    envs.close()
    envs.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        envs.step(actions)
    with pytest.raises(ValueError, match="at least one"):
        fetch_env.FetchVectorEnv("FetchPush-v4", 0)
    with pytest.raises(ValueError, match="Mode"):
        fetch_env.FetchVectorEnv("FetchPush-v4", 1, autoreset_mode="Never")
    # Some versions of Gymnasium close what could not be made.
    fetch_env.FetchVectorEnv.__new__(fetch_env.FetchVectorEnv).close()


def test_pictures_of_each_environment():
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2, render_mode="rgb_array", width=40, height=30)
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.render()
    envs.reset(seed=0)
    pictures = envs.render()
    assert [picture.shape for picture in pictures] == [(30, 40, 3)] * 2
    assert not np.array_equal(*pictures)
    assert np.array_equal(envs.call("render"), pictures)
    without = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    assert without.render() is None
    assert without.call("render") == (None, None)


def step_in_child(queue, env, envs):
    """Report what steps do in a forked process."""
    reported = [env.step(np.zeros(4, np.float32))[0]["observation"]]
    for call in (lambda: envs.step(np.zeros((2, 4), np.float32)), envs.reset):
        with pytest.raises(RuntimeError) as error:
            call()
        reported.append(str(error.value))
    queue.put(reported)


def test_a_forked_process_makes_its_own_vector(push):
    context = multiprocessing.get_context("fork")
    queue = context.SimpleQueue()
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    envs.reset(seed=0)
    child = context.Process(target=step_in_child, args=(queue, push, envs))
    child.start()
    observation, *errors = queue.get()
    child.join()
    assert child.exitcode == 0
    np.testing.assert_array_equal(observation, push.step(np.zeros(4, np.float32))[0]["observation"])
    assert len(errors) == 2
    assert all("make new environments in this process" in error for error in errors)


def make_in_child(sender):
    """Report the shapes of what a forked process makes."""
    env = fetch_env.FetchEnv("FetchReach-v4")
    envs = fetch_env.FetchVectorEnv("FetchReach-v4", 2)
    made = [env.reset(seed=0)[0], envs.reset(seed=0)[0]]
    sender.send([observation["observation"].shape for observation in made])


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_process_is_forked_while_other_threads_make_environments():
    context = multiprocessing.get_context("fork")
    done = threading.Event()

    def make_others(substeps):
        # Each is the only environment of its substeps, and so compiles a model.
        while not done.is_set():
            fetch_env.FetchEnv("FetchReach-v4", n_substeps=substeps).close()

    others = [threading.Thread(target=make_others, args=(substeps,)) for substeps in (1, 2)]
    for other in others:
        other.start()
    try:
        for _ in range(10):
            receiver, sender = context.Pipe(duplex=False)
            child = context.Process(target=make_in_child, args=(sender,))
            child.start()
            answers = receiver.poll(60)
            child.kill()
            assert answers
            assert receiver.recv() == [(10,), (2, 10)]
    finally:
        done.set()
        for other in others:
            other.join()


def test_gymnasiums_processes_step_the_environments(actions):
    envs = gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=2, vectorization_mode="async")
    ours = gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=2)
    try:
        assert_same_observation(ours.reset(seed=0)[0], envs.reset(seed=0)[0])
        for step in range(3):
            batch = actions[step : step + 2]
            assert_same_observation(ours.step(batch)[0], envs.step(batch)[0])
    finally:
        envs.close()
