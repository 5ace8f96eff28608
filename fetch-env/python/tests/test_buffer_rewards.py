"""The rewards of relabeled goals in a replay buffer: the environment's, or a function's."""

import types

import fetch_env
import gymnasium
import numpy as np
import pytest
from buffers import STEPS, fill, flat, single, vector


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
