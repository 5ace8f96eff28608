"""What a replay buffer takes and draws: rewards, kinds of transitions, shapes, seeds and sizes."""

import copy
import multiprocessing
import pickle
import types
from binascii import crc32

import fetch_env
import gymnasium
import numpy as np
import pytest

STEPS = 50


def fill(envs, buffer, actions, steps=STEPS + 1):
    """Record an episode of each environment."""
    envs.reset(seed=0)
    buffer.record(envs)
    for step in range(steps):
        envs.step(actions[step : step + envs.num_envs])
        buffer.record(envs)
    return buffer


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


def flat(achieved_goal, desired_goal, info):
    """Judge x and y alone."""
    assert len(info) == len(achieved_goal)
    return -np.linalg.norm((achieved_goal - desired_goal)[..., :2], axis=-1)


def low(achieved_goal, desired_goal, info):
    """Punish height."""
    del info
    far = np.linalg.norm(achieved_goal - desired_goal, axis=-1) > 0.1
    return -far.astype(np.float64) - 10.0 * (achieved_goal[..., 2] > 0.45)


@pytest.mark.parametrize("reward", [flat, low, lambda *goals: np.arange(len(goals[0]))])
@pytest.mark.parametrize("strategy", ["future", "random"])
def test_relabelled_rewards_are_those_of_a_function(actions, reward, strategy):
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    calls = []

    def counted(*arguments):
        calls.append(arguments)
        return reward(*arguments)

    buffer = fill(envs, fetch_env.HerBuffer(envs, 1000, reward=counted), actions)
    batch = buffer.sample(256, strategy=strategy, seed=1)
    ((achieved, desired, infos),) = calls
    new = batch["relabeled"]
    assert 0 < new.sum() < 256
    assert infos == [{}] * new.sum()
    np.testing.assert_array_equal(achieved, batch["next_achieved_goal"][new])
    np.testing.assert_array_equal(desired, batch["desired_goal"][new])
    expected = reward(achieved, desired, infos).astype(np.float32)
    np.testing.assert_array_equal(batch["reward"][new], expected)
    # The others keep the rewards of the environments.
    goals = batch["next_achieved_goal"][~new], batch["desired_goal"][~new]
    np.testing.assert_array_equal(batch["reward"][~new], envs.compute_reward(*goals))
    # Everything else is as without the function.
    other = fill(envs, fetch_env.HerBuffer(envs, 1000), actions).sample(
        256, strategy=strategy, seed=1
    )
    for key in batch.keys() - {"reward"}:
        np.testing.assert_array_equal(batch[key], other[key])


class OfXAndY(fetch_env.FetchEnv):
    """Has rewards of its own, and steps without them."""

    def compute_reward(self, achieved_goal, desired_goal, info):
        return flat(achieved_goal, desired_goal, info)


class VectorOfXAndY(fetch_env.FetchVectorEnv):
    """Has rewards of its own, and steps without them."""

    compute_reward = OfXAndY.compute_reward


class Judging(gymnasium.Wrapper):
    """Has rewards of its own."""

    def compute_reward(self, achieved_goal, desired_goal, info):
        return flat(achieved_goal, desired_goal, info)


class VectorJudging(gymnasium.vector.VectorWrapper):
    """Has rewards of its own."""

    compute_reward = Judging.compute_reward


class Forwarding(gymnasium.Wrapper):
    """Forwards what it does not have, as many wrappers do."""

    def __getattr__(self, name):
        return getattr(self.env, name)


class ForwardingJudge(Forwarding):
    """Has rewards of its own among what it forwards."""

    def __getattr__(self, name):
        return flat if name == "compute_reward" else super().__getattr__(name)


def with_attribute(make, where=lambda env: env):
    """Return an environment whose function was replaced."""

    def made():
        env = make("FetchPush-v4")
        where(env).compute_reward = flat
        return env

    return made


def of_another(make):
    """Return an environment with the function of one with another threshold."""

    def made():
        env = make("FetchPush-v4")
        other = make("FetchPush-v4", distance_threshold=0.2)
        env.compute_reward = other.compute_reward
        return env

    return made


def bound_to_another():
    env = fetch_env.FetchEnv("FetchPush-v4")
    other = fetch_env.FetchEnv("FetchPush-v4", distance_threshold=0.2)
    env.compute_reward = types.MethodType(fetch_env.FetchEnv.compute_reward, other)
    return env


def single():
    return gymnasium.make("fetch_env/FetchPush-v4")


def vector():
    return gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=2)


OWN_REWARDS = {
    "subclass": lambda: OfXAndY("FetchPush-v4"),
    "subclass in wrappers": lambda: gymnasium.wrappers.TimeLimit(OfXAndY("FetchPush-v4"), 50),
    "subclass of the vector": lambda: VectorOfXAndY("FetchPush-v4", 2),
    "wrapper": lambda: Judging(single()),
    "wrapper in wrappers": lambda: gymnasium.wrappers.RescaleAction(Judging(single()), -1, 1),
    "wrapper that forwards": lambda: ForwardingJudge(single()),
    "wrapper of the vector": lambda: VectorJudging(vector()),
    "attribute": with_attribute(fetch_env.FetchEnv),
    "attribute of the vector": with_attribute(fetch_env.FetchVectorEnv),
    "attribute of a wrapper": with_attribute(lambda _: single()),
    "attribute below wrappers": with_attribute(lambda _: single(), lambda env: env.unwrapped),
    "of another": of_another(fetch_env.FetchEnv),
    "of another vector": of_another(fetch_env.FetchVectorEnv),
    "bound to another": bound_to_another,
    "TransformReward": lambda: gymnasium.wrappers.TransformReward(single(), lambda r: r),
    "NormalizeReward": lambda: gymnasium.wrappers.NormalizeReward(single()),
    "ClipReward": lambda: gymnasium.wrappers.ClipReward(single(), -0.5, 0.0),
    "TransformReward of the vector": lambda: gymnasium.wrappers.vector.TransformReward(
        vector(), lambda r: 2 * r
    ),
    "NormalizeReward of the vector": lambda: gymnasium.wrappers.vector.NormalizeReward(vector()),
}


@pytest.mark.parametrize("made", OWN_REWARDS)
def test_rewards_of_its_own_need_a_function(made):
    env = OWN_REWARDS[made]()
    with pytest.raises(ValueError, match=r"has rewards of its own.* pass reward="):
        fetch_env.HerBuffer(env, 1000)
    assert fetch_env.HerBuffer(env, 1000, reward=flat).capacity == 1000


def test_a_replaced_function_of_the_class_is_noticed(monkeypatch):
    monkeypatch.setattr(fetch_env.FetchEnv, "compute_reward", OfXAndY.compute_reward)
    with pytest.raises(ValueError, match="FetchEnv has rewards of its own"):
        fetch_env.HerBuffer(single(), 1000)


def test_wrappers_with_the_same_rewards_are_taken(actions):
    for wrapped in (
        single(),
        gymnasium.wrappers.RecordEpisodeStatistics(single()),
        Forwarding(single()),
        gymnasium.wrappers.vector.RecordEpisodeStatistics(vector()),
    ):
        assert fetch_env.HerBuffer(wrapped, STEPS).capacity == STEPS
    envs = vector()
    buffer = fetch_env.HerBuffer(gymnasium.wrappers.vector.RecordEpisodeStatistics(envs), STEPS)
    fill(envs, buffer, actions, 1)
    assert buffer.unfinished_steps(env_index=1) == 1
    with pytest.raises(TypeError, match="not a FetchEnv"):
        fetch_env.HerBuffer(gymnasium.make("CartPole-v1"), 1000)


@pytest.mark.parametrize(
    ("reward", "error", "message"),
    [
        (lambda *_: 1 / 0, ZeroDivisionError, "division"),
        (lambda _, __, infos: [info["cost"] for info in infos], KeyError, "cost"),
        (lambda *_: -1.0, ValueError, r"of the shape \(\): return \(\d+,\)"),
        (lambda a, *_: -a, ValueError, r"of the shape \(\d+, 3\): return \(\d+,\)"),
        (lambda a, *_: -a[:, :1], ValueError, r"of the shape \(\d+, 1\)"),
        (lambda a, *_: a[:, 0] * np.nan, ValueError, "NaN for row 0: return finite"),
        (lambda a, *_: [1e300] * len(a), ValueError, "returned 1e300 for row 0"),
        (lambda *_: "none", ValueError, "result: pass an array of real numbers"),
        (lambda: 0.0, TypeError, "positional"),
    ],
)
def test_an_error_of_the_function_is_the_error_of_the_draw(actions, reward, error, message):
    envs = fetch_env.FetchVectorEnv("FetchReach-v4", 2)
    buffer = fill(envs, fetch_env.HerBuffer(envs, 1000, reward=reward), actions)
    with pytest.raises(error, match=message):
        buffer.sample(64)
    assert not buffer.sample(64, k=0.0)["relabeled"].any()


def test_a_function_that_uses_its_buffer_does_not_hang(actions):
    envs = fetch_env.FetchVectorEnv("FetchReach-v4", 2)
    buffer = fetch_env.HerBuffer(envs, 1000, reward=lambda *_: buffer.sample(8)["reward"])
    fill(envs, buffer, actions)
    with pytest.raises(RuntimeError, match="in use by the call that led to this one"):
        buffer.sample(64)
    with pytest.raises(TypeError, match="pass a function"):
        fetch_env.HerBuffer(envs, 1000, reward="sparse")


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


def test_an_episode_has_one_goal():
    env = fetch_env.FetchEnv("FetchReach-v4")
    buffer = fetch_env.HerBuffer(env, 1000)
    buffer.begin_episode(env.reset(seed=0)[0])
    action = np.zeros(4, np.float32)

    def step():
        observation, reward, terminated, truncated, _ = env.step(action)
        buffer.add_step(action, observation, reward, terminated=terminated, truncated=truncated)

    step()
    env.goal = env.goal + 0.01
    with pytest.raises(ValueError, match="desired_goal is not that of the episode under way"):
        step()
    assert buffer.unfinished_steps() == 1


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
    for name in ("_seeds", "_reward", "_episode_len"):
        del state[name]
    other = fetch_env.HerBuffer.__new__(fetch_env.HerBuffer)
    other.__setstate__(state)
    assert draws_with(other, 1) == draws_with(buffer, 1)
    assert len(set(draws(other))) == 3
    push = fetch_env.HerBuffer(fetch_env.FetchEnv("FetchPush-v4"), 1000)
    with pytest.raises(ValueError, match="observation"):
        push.load(tmp_path / "plain")
