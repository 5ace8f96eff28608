"""What a replay buffer takes and draws: kinds of transitions, shapes, seeds and sizes."""

import copy
import multiprocessing
import pickle
from binascii import crc32

import fetch_env
import gymnasium
import numpy as np
import pytest
from buffers import STEPS, flat, single, vector


def episode(steps=STEPS, width=10, **others):
    """Return an episode of Reach."""
    random = np.random.default_rng(0)
    return {
        "observation": random.normal(size=(steps + 1, width)),
        "achieved_goal": random.normal(size=(steps + 1, 3)),
        "desired_goal": random.normal(size=3),
        "action": random.normal(size=(steps, 4)),
        "reward": np.full(steps, -1.0),
        **others,
    }


@pytest.mark.parametrize(
    ("settings", "is_same"),
    [
        ({}, True),
        ({"env_id": "fetch_env/FetchPush-v4"}, True),
        ({"max_episode_steps": 20}, True),
        ({"target_range": 0.05, "object_range": 0.2}, True),
        ({"env_id": "FetchSlide-v4"}, False),
        ({"env_id": "FetchPushDense-v4"}, False),
        ({"reward_type": "dense"}, False),
        ({"distance_threshold": 0.02}, False),
        ({"n_substeps": 10}, False),
    ],
)
def test_a_buffer_holds_transitions_of_one_kind(tmp_path, settings, is_same):
    def make(env_id="FetchPush-v4", **settings):
        envs = fetch_env.FetchVectorEnv(env_id, 2, **settings)
        envs.reset(seed=0)
        return envs, fetch_env.HerBuffer(envs, 1000)

    (_, buffer), (envs, other) = make(), make(**settings)
    other.record(envs)
    other.save(tmp_path / "buffer")
    state = {**buffer.__getstate__(), "_native": other.__getstate__()["_native"]}
    for call in (
        lambda: buffer.record(envs),
        lambda: buffer.resume(envs),
        lambda: buffer.load(tmp_path / "buffer"),
        lambda: buffer.__setstate__(dict(state)),
    ):
        if is_same:
            call()
            assert buffer.unfinished_steps() == 0
        else:
            with pytest.raises(ValueError, match="transitions of another kind"):
                call()


def test_a_file_says_whose_rewards_relabelled_rows_get(tmp_path):
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    ours, own = fetch_env.HerBuffer(envs, 1000), fetch_env.HerBuffer(envs, 1000, reward=flat)
    for one, another in ((ours, own), (own, ours)):
        one.save(tmp_path / "buffer")
        one.load(tmp_path / "buffer")
        with pytest.raises(ValueError, match="transitions of another kind"):
            another.load(tmp_path / "buffer")
    again = pickle.loads(pickle.dumps(own))
    again.add_episode(**episode(width=25))
    batch = again.sample(64, k=1e9)
    goals = batch["next_achieved_goal"], batch["desired_goal"]
    np.testing.assert_array_equal(batch["reward"], flat(*goals, [{}] * 64))


@pytest.mark.parametrize(
    ("part", "shape"),
    [
        ("observation", (10, 51)),
        ("observation", (510,)),
        ("observation", (50, 10)),
        ("observation", (51, 10, 1)),
        ("achieved_goal", (3, 51)),
        ("achieved_goal", (153,)),
        ("desired_goal", (1, 3)),
        ("desired_goal", (51, 3)),
        ("action", (4, 50)),
        ("action", (200,)),
        ("action", (51, 4)),
        ("reward", (50, 1)),
        ("reward", (1, 50)),
        ("reward", ()),
    ],
)
def test_an_episode_of_another_shape_is_refused(part, shape):
    buffer = fetch_env.HerBuffer(fetch_env.FetchEnv("FetchReach-v4"), 1000)
    with pytest.raises(ValueError, match=rf"{part} has the shape \(.*\): pass \("):
        buffer.add_episode(**episode(**{part: np.zeros(shape)}))
    buffer.add_episode(**episode())
    assert len(buffer) == STEPS


def test_states_and_steps_of_another_shape_are_refused():
    buffer = fetch_env.HerBuffer(fetch_env.FetchEnv("FetchReach-v4"), 1000)
    state = {"observation": np.zeros(10), "achieved_goal": np.zeros(3), "desired_goal": np.zeros(3)}
    for part, numbers in state.items():
        for wrong in (numbers[None], numbers[:, None], numbers[:-1]):
            with pytest.raises(ValueError, match=f"{part} has the shape"):
                buffer.begin_episode({**state, part: wrong})
    buffer.begin_episode(state)

    def step(action, **parts):
        buffer.add_step(action, {**state, **parts}, 0.0, terminated=False, truncated=False)

    for wrong in (np.zeros((1, 4)), np.zeros((2, 2)), np.zeros(3), 0.0):
        with pytest.raises(ValueError, match="action has the shape"):
            step(wrong)
    for part in ("observation", "achieved_goal"):
        with pytest.raises(ValueError, match=f"{part} has the shape"):
            step(np.zeros(4), **{part: state[part][None]})
    assert buffer.unfinished_steps() == 0


def test_a_new_goal_begins_another_episode():
    env = fetch_env.FetchEnv("FetchReach-v4")
    buffer = fetch_env.HerBuffer(env, 1000)
    buffer.begin_episode(env.reset(seed=0)[0])
    action = np.zeros(4, np.float32)
    for time in range(10):
        if time in {3, 4, 8}:
            env.goal = env.goal + 0.01
        observation, reward, terminated, truncated, _ = env.step(action)
        buffer.add_step(action, observation, reward, terminated=terminated, truncated=truncated)
    assert (len(buffer), buffer.num_episodes, buffer.unfinished_steps()) == (8, 3, 2)


def test_a_reward_that_is_assigned_later_is_noticed():
    env = single()
    buffer = fetch_env.HerBuffer(env, 1000)
    buffer.begin_episode(env.reset(seed=0)[0])
    env.unwrapped.target_range = 0.1
    action = np.zeros(4, np.float32)

    def step():
        observation, reward, terminated, truncated, _ = env.step(action)
        buffer.add_step(action, observation, reward, terminated=terminated, truncated=truncated)

    step()
    for name, value in {"distance_threshold": 0.3, "reward_type": "dense"}.items():
        before = getattr(env.unwrapped, name)
        setattr(env.unwrapped, name, value)
        with pytest.raises(ValueError, match="transitions of another kind"):
            step()
        setattr(env.unwrapped, name, before)
    step()
    assert copy.deepcopy(buffer).unfinished_steps() == 2


def draws(buffer, count=3):
    return [buffer.sample(16)["action"].tobytes() for _ in range(count)]


def seeded(*seed):
    buffer = fetch_env.HerBuffer(
        fetch_env.FetchEnv("FetchReach-v4"), 1000, **dict(zip(["seed"], seed, strict=False))
    )
    buffer.add_episode(**episode())
    return buffer


def test_each_buffer_draws_from_a_sequence_of_its_own():
    sequences = [draws(seeded()) for _ in range(3)]
    assert len({batch for sequence in sequences for batch in sequence}) == 9
    assert draws(seeded(7)) == draws(seeded(7)) != draws(seeded(8))
    buffer = seeded(7)
    first = draws(buffer)
    assert buffer.sample(16, seed=3)["action"].tobytes() == draws_with(buffer, 3)
    assert first + draws(buffer) == draws(seeded(7), 6)
    with pytest.raises(ValueError, match="negative"):
        seeded(-1)


def draws_with(buffer, seed):
    return buffer.sample(16, seed=seed)["action"].tobytes()


@pytest.mark.parametrize("again", [copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
@pytest.mark.parametrize("seed", [(), (7,)])
def test_a_copy_continues_the_sequence(again, seed):
    buffer = seeded(*seed)
    draws(buffer)
    other = again(buffer)
    assert draws(buffer) == draws(other)


def put_draws(queue, buffer):
    queue.put(draws(buffer))


@pytest.mark.parametrize("seed", [(), (7,)])
def test_a_forked_process_draws_its_own_batches_unless_a_seed_was_given(seed):
    context = multiprocessing.get_context("fork")
    queue = context.SimpleQueue()
    buffer = seeded(*seed)
    draws(buffer)
    child = context.Process(target=put_draws, args=(queue, buffer))
    child.start()
    theirs = queue.get()
    child.join()
    assert (theirs == draws(buffer)) == bool(seed)


def test_a_buffer_holds_a_whole_episode(tmp_path):
    limited = gymnasium.wrappers.TimeLimit(fetch_env.FetchEnv("FetchReach-v4"), 20)
    for env, steps in (
        (single(), 50),
        (vector(), 50),
        (fetch_env.FetchVectorEnv("FetchReach-v4", 3, max_episode_steps=70), 70),
        (gymnasium.make("fetch_env/FetchReach-v4", max_episode_steps=100), 100),
        (limited, 20),
    ):
        message = f"capacity is {steps - 1} transitions, .* up to {steps} steps: pass at least"
        with pytest.raises(ValueError, match=message):
            fetch_env.HerBuffer(env, steps - 1)
        assert fetch_env.HerBuffer(env, steps).capacity == steps
    # An environment without a limit has episodes of any length.
    unlimited = fetch_env.FetchEnv("FetchReach-v4")
    small = fetch_env.HerBuffer(unlimited, 1)
    small.save(tmp_path / "buffer")
    buffer = fetch_env.HerBuffer(limited, 100)
    with pytest.raises(ValueError, match="capacity is 1 transitions"):
        buffer.load(tmp_path / "buffer")
    assert buffer.capacity == 100


def test_a_file_that_does_not_say_what_it_holds_is_read_with_a_warning(tmp_path):
    buffer = seeded()
    buffer.save(tmp_path / "buffer")
    # Version 2 of the format has no description, which follows the six sizes.
    described = (tmp_path / "buffer").read_bytes()
    at = 16 + 6 * 8
    length = int.from_bytes(described[at : at + 8], "little")
    plain = described[:8] + b"\2" + described[9:at] + described[at + 8 + length : -4]
    (tmp_path / "plain").write_bytes(plain + crc32(plain).to_bytes(4, "little"))
    other = fetch_env.HerBuffer(fetch_env.FetchEnv("FetchReach-v4"), 1000)
    with pytest.warns(UserWarning, match="does not say what it holds: .*FetchReach-v4"):
        other.load(tmp_path / "plain")
    assert draws_with(other, 1) == draws_with(buffer, 1)
    state = {**buffer.__getstate__(), "_native": (1000, 1, (tmp_path / "plain").read_bytes())}
    for name in ("_seeds", "_reward", "_terminated", "_settings", "_episode_len"):
        del state[name]
    other = fetch_env.HerBuffer.__new__(fetch_env.HerBuffer)
    other.__setstate__(state)
    assert draws_with(other, 1) == draws_with(buffer, 1)
    assert len(set(draws(other))) == 3
    push = fetch_env.HerBuffer(fetch_env.FetchEnv("FetchPush-v4"), 1000)
    with pytest.raises(ValueError, match="observation"):
        push.load(tmp_path / "plain")
