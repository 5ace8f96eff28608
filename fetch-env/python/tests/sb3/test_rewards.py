"""Rewards, kinds of transitions and sizes of the buffer for Stable-Baselines3."""

import pickle
import re

import fetch_env
import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from fetch_env import sb3
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import (
    DummyVecEnv,
    SubprocVecEnv,
    VecMonitor,
    VecNormalize,
)


def flat(achieved_goal, desired_goal, info):
    """Judge x and y alone."""
    assert list(info) == [{}] * len(achieved_goal)
    return -np.linalg.norm((achieved_goal - desired_goal)[..., :2], axis=-1)


def model(env, replay_buffer_class=sb3.HerReplayBuffer, buffer_size=1000, **kwargs):
    return SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=replay_buffer_class,
        replay_buffer_kwargs=kwargs,
        buffer_size=buffer_size,
        learning_starts=10_000,
        policy_kwargs={"net_arch": [8]},
        device="cpu",
        seed=0,
    )


class OfXAndY(fetch_env.FetchEnv):
    """Has rewards of its own, and steps without them."""

    def compute_reward(self, achieved_goal, desired_goal, info):
        return flat(achieved_goal, desired_goal, info)


class Judging(gymnasium.Wrapper):
    """Has rewards of its own."""

    def compute_reward(self, achieved_goal, desired_goal, info):
        return flat(achieved_goal, desired_goal, info)


def single(**settings):
    return gymnasium.make("fetch_env/FetchReach-v4", **settings)


def subclass():
    return Monitor(gymnasium.wrappers.TimeLimit(OfXAndY("FetchReach-v4"), 50))


def wrapped():
    return Monitor(Judging(single()))


def transformed():
    return gymnasium.wrappers.TransformReward(single(), lambda reward: reward - 0.5)


def with_attribute():
    env = single()
    env.unwrapped.compute_reward = flat
    return env


def vector_with_attribute():
    env = sb3.FetchVecEnv("FetchReach-v4", 2)
    env.envs.compute_reward = flat
    return env


OWN_REWARDS = {
    "subclass": subclass,
    "wrapper": wrapped,
    "TransformReward": transformed,
    "attribute": with_attribute,
    "second of two": lambda: DummyVecEnv([single, wrapped]),
    "in VecNormalize": lambda: VecNormalize(DummyVecEnv([wrapped])),
    "attribute of the vector": vector_with_attribute,
    "processes": lambda: SubprocVecEnv([single, transformed], start_method="fork"),
    "subclass in processes": lambda: SubprocVecEnv([subclass], start_method="fork"),
}


@pytest.mark.parametrize("made", OWN_REWARDS)
def test_rewards_of_its_own_need_a_function(made):
    env = OWN_REWARDS[made]()
    with pytest.raises(ValueError, match=r"has rewards of its own.* pass reward="):
        model(env)
    assert model(env, reward=flat).replay_buffer.size() == 0
    env.close()


class Shifted(gymnasium.Wrapper):
    """Changes the rewards of steps alone."""

    def step(self, action):
        observation, reward, *rest = self.env.step(action)
        return observation, reward - 0.25, *rest


@pytest.mark.parametrize("reward_type", ["sparse", "dense"])
@pytest.mark.parametrize("wrap", [Shifted, lambda env: env])
def test_rewards_that_steps_change_are_noticed(wrap, reward_type):
    env = wrap(single(reward_type=reward_type))
    learner = model(env)
    if wrap is Shifted:
        with pytest.raises(ValueError, match=r"reward .* but .* for its goals: pass reward="):
            learner.learn(10)
        model(env, reward=flat).learn(60)
    else:
        learner.learn(110)
        assert learner.replay_buffer.size() == 100


@pytest.mark.parametrize(
    "make",
    [
        lambda: sb3.FetchVecEnv("FetchReach-v4", 2),
        lambda: sb3.FetchVecEnv("FetchReachDense-v4", 2),
        lambda: VecNormalize(VecMonitor(sb3.FetchVecEnv("FetchReachDense-v4", 2))),
        lambda: DummyVecEnv([lambda: Monitor(single(reward_type="dense"))] * 2),
        lambda: SubprocVecEnv([single] * 2, start_method="fork"),
    ],
)
def test_every_row_has_the_reward_of_its_goals(make):
    env = make()
    learner = model(env)
    learner.learn(200)
    assert learner.replay_buffer.size() == 200
    plain = fetch_env.FetchEnv("FetchReach-v4", reward_type=env.get_attr("reward_type")[0])
    batch = learner.replay_buffer.sample(256)
    goals = (batch.next_observations[key] for key in ("achieved_goal", "desired_goal"))
    expected = plain.compute_reward(*(goal.numpy() for goal in goals))
    # The rewards of steps are of goals in double precision.
    np.testing.assert_allclose(batch.rewards.numpy()[:, 0], expected, atol=1e-6)
    env.close()


def test_relabelled_rewards_are_those_of_a_function(tmp_path):
    env = sb3.FetchVecEnv("FetchReach-v4", 2)
    learner = model(env, reward=flat, n_sampled_goal=10_000)
    learner.learn(200)
    learner.save_replay_buffer(tmp_path / "buffer.pkl")
    learner.load_replay_buffer(tmp_path / "buffer.pkl")
    batch = learner.replay_buffer.sample(256)
    goals = [batch.next_observations[key].numpy() for key in ("achieved_goal", "desired_goal")]
    np.testing.assert_array_equal(batch.rewards.numpy()[:, 0], flat(*goals, [{}] * 256))


def test_infos_are_refused_with_a_reason():
    with pytest.raises(ValueError, match="infos, which this buffer does not store: pass reward="):
        model(single(), copy_info_dict=True)
    with pytest.raises(TypeError, match="pass a function"):
        model(single(), reward="sparse")
    env = DummyVecEnv([lambda: gymnasium.make("CartPole-v1")])
    with pytest.raises(TypeError, match="not dictionaries of observation"):
        sb3.HerReplayBuffer(100, env.observation_space, env.action_space, env)


@pytest.mark.parametrize(
    "settings",
    [{"distance_threshold": 0.2}, {"reward_type": "dense"}, {"n_substeps": 10}],
)
def test_a_loaded_buffer_of_another_kind_is_refused(tmp_path, settings):
    learner = model(sb3.FetchVecEnv("FetchReach-v4", 2))
    learner.learn(200)
    learner.save_replay_buffer(tmp_path / "buffer.pkl")
    other = model(sb3.FetchVecEnv("FetchReach-v4", 2, **settings))
    before = other.replay_buffer
    with pytest.raises(ValueError, match="transitions of another kind"):
        other.load_replay_buffer(tmp_path / "buffer.pkl")
    state = {**before.__getstate__(), "_native": learner.replay_buffer.__getstate__()["_native"]}
    with pytest.raises(ValueError, match="transitions of another kind"):
        before.__setstate__(state)
    same = model(sb3.FetchVecEnv("FetchReach-v4", 2))
    same.load_replay_buffer(tmp_path / "buffer.pkl")
    assert same.replay_buffer.size() == 200
    assert pickle.loads(pickle.dumps(same.replay_buffer)).size() == 200


def test_environments_of_different_kinds_are_refused():
    env = DummyVecEnv([single, lambda: single(distance_threshold=0.2)])
    with pytest.raises(ValueError, match="transitions of another kind"):
        model(env)


def test_a_buffer_holds_a_whole_episode():
    for env in (sb3.FetchVecEnv("FetchReach-v4", 2), single(), Monitor(single())):
        with pytest.raises(ValueError, match="up to 50 steps: pass at least 50"):
            model(env, buffer_size=49)
        assert model(env, buffer_size=50).replay_buffer.size() == 0


def test_drawing_too_early_names_learning_starts():
    learner = model(sb3.FetchVecEnv("FetchReach-v4", 4))
    learner.learning_starts = 100
    with pytest.raises(ValueError, match="set learning_starts to at least 200"):
        learner.learn(120)
    # A learner that starts there can learn.
    learner = model(sb3.FetchVecEnv("FetchReach-v4", 4))
    learner.learning_starts = 200
    learner.learn(208)
    assert learner._n_updates > 0  # noqa: SLF001


def test_the_example_runs_as_printed(monkeypatch):
    example = sb3.__doc__.split(".. code-block:: python\n")[1]
    code = re.sub(r"^ {4}", "", example, flags=re.MULTILINE)
    learn = SAC.learn

    def shortly(self, total_timesteps):
        assert total_timesteps == 20_000
        return learn(self, 212)

    monkeypatch.setattr(SAC, "learn", shortly)
    made = {}
    exec(code, made)  # noqa: S102
    assert made["model"].replay_buffer.size() == 200
    assert made["model"]._n_updates > 0  # noqa: SLF001


def test_theirs_takes_what_ours_refuses():
    model(wrapped(), HerReplayBuffer).learn(55)
