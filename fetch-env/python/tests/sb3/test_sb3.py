"""The parts for Stable-Baselines3, next to its own."""

import pickle

import fetch_env
import gymnasium
import numpy as np
import pytest

stable_baselines3 = pytest.importorskip("stable_baselines3")

from fetch_env import sb3  # noqa: E402
from stable_baselines3 import SAC, HerReplayBuffer  # noqa: E402
from stable_baselines3.common.env_checker import check_env  # noqa: E402
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize  # noqa: E402


def model(env, buffer=sb3.HerReplayBuffer, **settings):
    return SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=buffer,
        replay_buffer_kwargs={"n_sampled_goal": 4, "goal_selection_strategy": "future"},
        learning_starts=200,
        policy_kwargs={"net_arch": [32, 32]},
        device="cpu",
        seed=0,
        **settings,
    )


def test_their_checker_passes(env_id):
    check_env(gymnasium.make(f"fetch_env/{env_id}").unwrapped)


def test_the_vector_is_as_theirs(actions):
    ours = sb3.FetchVecEnv("FetchPush-v4", 2)
    theirs = DummyVecEnv([lambda: gymnasium.make("fetch_env/FetchPush-v4")] * 2)
    for envs in (ours, theirs):
        envs.seed(5)
        assert envs.metadata["render_fps"] == 25
    starts = ours.reset(), theirs.reset()
    for step in range(55):
        batch = actions[step : step + 2]
        results = [envs.step(batch) for envs in (ours, theirs)]
        for one, another in zip(results[0][1:3], results[1][1:3], strict=True):
            assert one.dtype == another.dtype
            np.testing.assert_array_equal(one, another)
        for key, numbers in results[0][0].items():
            np.testing.assert_array_equal(numbers, results[1][0][key])
        for one, another in zip(results[0][3], results[1][3], strict=True):
            assert one["is_success"] == another["is_success"]
            assert one["TimeLimit.truncated"] == another["TimeLimit.truncated"]
            last = [info.get("terminal_observation", {}) for info in (one, another)]
            assert last[0].keys() == last[1].keys()
            for key, numbers in last[0].items():
                np.testing.assert_array_equal(numbers, last[1][key])
    assert starts[0].keys() == starts[1].keys()


def test_attributes_and_methods_are_those_of_the_chosen_environments(monkeypatch):
    env = sb3.FetchVecEnv("FetchPush-v4", 3)
    env.seed(5)
    observations = env.reset()
    goals = observations["achieved_goal"], observations["desired_goal"]
    calls = []
    compute_reward = env.envs.compute_reward
    counted = lambda *goals: calls.append(goals) or compute_reward(*goals)  # noqa: E731
    monkeypatch.setattr(env.envs, "compute_reward", counted)
    (rewards,) = env.env_method("compute_reward", *goals, [{}] * 3, indices=[0])
    assert rewards.tolist() == [-1.0] * 3
    assert len(calls) == 1
    (compute_reward,) = env.get_attr("compute_reward", indices=1)
    assert callable(compute_reward)
    assert env.has_attr("compute_reward")
    assert np.array_equal(env.get_attr("goal", indices=[2])[0], observations["desired_goal"][2])
    assert env.env_method("render", indices=[1]) == [None]
    state = env.envs.get_state()
    for name in ("reset", "step", "close"):
        assert not env.has_attr(name)
        with pytest.raises(AttributeError, match=name):
            env.env_method(name)
    assert env.envs.get_state() == state


def test_a_single_thread_is_the_callers(monkeypatch, actions):
    ours = VecNormalize(sb3.FetchVecEnv("FetchPush-v4", 2, num_threads=1), norm_reward=False)
    theirs = VecNormalize(sb3.FetchVecEnv("FetchPush-v4", 2, num_threads=2), norm_reward=False)
    monkeypatch.setattr(ours.venv.envs, "step_async", None)
    for envs in (ours, theirs):
        envs.seed(5)
        envs.reset()
    for step in range(3):
        results = [envs.step(actions[step : step + 2]) for envs in (ours, theirs)]
        for key, numbers in results[0][0].items():
            np.testing.assert_array_equal(numbers, results[1][0][key])


@pytest.mark.parametrize("kind", ["ours", "theirs", "normalized"])
def test_a_model_learns_and_is_saved(tmp_path, kind):
    env = sb3.FetchVecEnv("FetchReach-v4", 2)
    if kind == "theirs":
        env = gymnasium.make("fetch_env/FetchReach-v4")
    if kind == "normalized":
        env = VecNormalize(env)
    learner = model(env)
    learner.learn(400)
    buffer = learner.replay_buffer
    assert buffer.size() in (392, 400, 400 - 400 % 100)
    learner.save_replay_buffer(tmp_path / "buffer.pkl")
    learner.save(tmp_path / "model.zip")
    again = SAC.load(tmp_path / "model.zip", env=learner.get_env())
    again.load_replay_buffer(tmp_path / "buffer.pkl")
    assert again.replay_buffer.size() == buffer.size()
    again.learn(100, reset_num_timesteps=False)
    assert pickle.loads(pickle.dumps(buffer)).size() == buffer.size()


def test_batches_are_as_theirs():
    """Draw from the same distribution: hardly any of the many means differ by four deviations."""
    learners = [
        model(gymnasium.make("fetch_env/FetchReachDense-v4"), buffer, learning_rate=0.0)
        for buffer in (sb3.HerReplayBuffer, HerReplayBuffer)
    ]
    for learner in learners:
        learner.learning_starts = 1000
        learner.learn(1000)
    batches = [learner.replay_buffer.sample(20_000) for learner in learners]
    far = 0
    columns = 0
    for part in ("observations", "next_observations"):
        for key in ("observation", "achieved_goal", "desired_goal"):
            one, another = (getattr(batch, part)[key] for batch in batches)
            # Theirs keeps the observations' float64.
            assert one.dtype == batches[0].rewards.dtype
            assert one.shape == another.shape
            deviation = (one.var(0) / len(one) + another.var(0) / len(one)).sqrt() + 1e-9
            far += int(((one.mean(0) - another.mean(0)).abs() > 4 * deviation).sum())
            columns += one.shape[1]
    assert far <= columns // 8
    rewards = [batch.rewards for batch in batches]
    assert rewards[0].shape == rewards[1].shape == (20_000, 1)
    assert abs(rewards[0].mean() - rewards[1].mean()) < 5 * rewards[0].std() / 100
    assert batches[0].dones.sum() == batches[1].dones.sum() == 0


def test_the_same_seed_draws_the_same_batch():
    learner = model(sb3.FetchVecEnv("FetchReach-v4", 2))
    learner.learn(200)
    draws = []
    for _ in range(2):
        np.random.seed(3)  # noqa: NPY002
        draws.append(learner.replay_buffer.sample(8).actions.numpy().tobytes())
    assert draws[0] == draws[1]
    assert fetch_env.HerBuffer(learner.get_env().envs, 50).capacity == 50
