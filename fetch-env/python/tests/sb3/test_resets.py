"""The buffer for Stable-Baselines3 stores what happened, also where something else resets."""

import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from fetch_env import sb3
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import (
    DummyVecEnv,
    SubprocVecEnv,
    VecEnvWrapper,
    VecMonitor,
    VecNormalize,
)

NUM_ENVS = 2
PARTS = "observation", "achieved_goal", "desired_goal"


class Spy(VecEnvWrapper):
    """Keeps all transitions of the environments inside: where each began, and where it ended."""

    def __init__(self, venv, happened):
        super().__init__(venv)
        self.happened = happened

    def reset(self):
        self.shown = self.venv.reset()
        return self.shown

    def step_wait(self):
        shown, rewards, dones, infos = self.venv.step_wait()
        for env_index, done in enumerate(dones):
            end = infos[env_index]["terminal_observation"] if done else row(shown, env_index)
            keep(self.happened, row(self.shown, env_index), end)
        self.shown = shown
        return shown, rewards, dones, infos


def watched(env, happened):
    """Keep the transitions of a single environment, also those of other callers."""
    step = env.unwrapped.step

    def watched_step(action):
        start = env.unwrapped._native.observe()  # noqa: SLF001
        results = step(action)
        keep(happened, start, results[0])
        return results

    env.unwrapped.step = watched_step
    return env


def watched_vector(envs, happened):
    """Keep the transitions of a vector, also those of other callers."""
    step, reset = envs.step, envs.reset
    shown = {}

    def watched_reset(**settings):
        results = reset(**settings)
        shown.update(results[0])
        return results

    def watched_step(actions):
        results = step(actions)
        infos = results[4]
        final = infos.get("_final_obs", np.zeros(NUM_ENVS, bool))
        for env_index in range(NUM_ENVS):
            ends = final[env_index]
            end = infos["final_obs"][env_index] if ends else row(results[0], env_index)
            keep(happened, row(shown, env_index), end)
        shown.update(results[0])
        return results

    envs.step, envs.reset = watched_step, watched_reset


def row(observations, env_index):
    return {part: numbers[env_index] for part, numbers in observations.items()}


def keep(happened, start, end):
    start = single([start[part] for part in PARTS])
    happened.setdefault(start.tobytes(), []).append(single([end[part] for part in PARTS[:2]]))


def single(parts):
    return np.concatenate(parts).astype(np.float32)


def made():
    return gymnasium.make("fetch_env/FetchReach-v4")


class SameGoal(gymnasium.Wrapper):
    """Begins every episode with the same goal."""

    def reset(self, **settings):
        goal = {"desired_goal": [1.3, 0.8, 0.5]}
        return self.env.reset(**{**settings, "options": goal})


def environments(kind, happened):
    if kind == "same goal":
        return DummyVecEnv([lambda: SameGoal(watched(made(), happened))] * NUM_ENVS)
    if kind == "subproc":
        return Spy(SubprocVecEnv([made] * NUM_ENVS, start_method="spawn"), happened)
    if kind == "dummy":
        return DummyVecEnv([lambda: Monitor(watched(made(), happened))] * NUM_ENVS)
    env = sb3.FetchVecEnv("FetchReach-v4", NUM_ENVS, num_threads=1)
    watched_vector(env.envs, happened)
    if kind == "monitored":
        return VecMonitor(env)
    return VecNormalize(env) if kind == "normalized" else env


def learner_of(env):
    return SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=sb3.HerReplayBuffer,
        learning_starts=10_000,
        policy_kwargs={"net_arch": [8]},
        device="cpu",
        seed=0,
    )


def stored(buffer, happened, tolerance=0.0):
    """Return how many transitions are stored, all of which must have happened."""
    for env_index in range(NUM_ENVS):
        if buffer._native.unfinished_steps(env_index) is not None:  # noqa: SLF001
            buffer._native.end_episode(env_index)  # noqa: SLF001
    batch = buffer._native.sample(50 * buffer.size(), '"future"', 0.0, 1)  # noqa: SLF001
    rows = np.concatenate([batch[part] for part in PARTS], axis=1)
    ends = np.concatenate([batch["next_" + part] for part in PARTS[:2]], axis=1)
    seen = set()
    for row, end in zip(rows, ends, strict=True):
        distances = [np.abs(end - other).max() for other in happened.get(row.tobytes(), [])]
        assert distances
        assert min(distances) <= tolerance
        seen.add(row.tobytes() + end.tobytes())
    assert len(seen) == buffer.size()
    return buffer.size()


def evaluates(learner):
    evaluate_policy(learner, learner.get_env(), n_eval_episodes=3, warn=False)


@pytest.mark.parametrize("kind", ["ours", "dummy", "monitored", "normalized"])
def test_nothing_is_joined_across_a_reset(kind):
    happened = {}
    env = environments(kind, happened)
    learner = learner_of(env)
    tolerance = 1e-4 if kind == "normalized" else 0.0  # their own ends, normalized and back
    steps = 0
    for _ in range(3):
        learner.learn(130)
        steps += learner.num_timesteps
    learner.learn(100)  # ends with the episodes
    learner.learn(20)
    steps += 120
    buffer = learner.replay_buffer
    assert stored(buffer, happened, tolerance) == steps
    if kind != "normalized":  # whose resets count as steps of the statistics
        env.reset()
        learner.learn(140, reset_num_timesteps=False)
        # Each acted once on an observation from before the reset.
        assert stored(buffer, happened) == steps + 140 - NUM_ENVS


@pytest.mark.parametrize("kind", ["ours", "dummy", "monitored", "normalized", "same goal"])
def test_a_step_after_an_evaluation_is_left_out(kind):
    happened = {}
    learner = learner_of(environments(kind, happened))
    tolerance = 1e-4 if kind == "normalized" else 0.0
    buffer, steps = learner.replay_buffer, 0
    for length in (130, 100, 20):  # in the middle of episodes, at their ends, and anywhere
        learner.learn(length, reset_num_timesteps=False)
        evaluates(learner)
        steps += length
    learner.learn(60, reset_num_timesteps=False)
    assert steps < stored(buffer, happened, tolerance) < steps + 60
    callback = EvalCallback(learner.get_env(), eval_freq=17, n_eval_episodes=2, warn=False)
    learner.learn(300, callback, reset_num_timesteps=False)
    stored(buffer, happened, tolerance)
    learner.learn(300, callback)
    stored(buffer, happened, tolerance)


def test_other_environments_of_a_model_are_followed_too():
    happened = {}
    learner = learner_of(environments("dummy", happened))
    for kind in ("dummy", "ours", "dummy"):
        learner.learn(70)
        learner.set_env(environments(kind, happened))
        learner.learn(70, reset_num_timesteps=False)
        evaluates(learner)
        learner.learn(70, reset_num_timesteps=False)
        stored(learner.replay_buffer, happened)


def test_environments_in_other_processes_are_followed():
    happened = {}
    env = environments("subproc", happened)
    learner = learner_of(env)
    learner.learn(70)
    learner.learn(70)
    evaluates(learner)
    learner.learn(70, reset_num_timesteps=False)
    stored(learner.replay_buffer, happened)
    env.close()


class Uses(BaseCallback):
    """Does something with the environment now and then."""

    def __init__(self, use):
        super().__init__()
        self.use = use

    def _on_step(self):
        if self.n_calls % 13 == 0:
            self.use()
        return True


def test_uses_behind_the_models_back_are_noticed():
    happened = {}
    env = environments("ours", happened)
    inner = env.envs
    learner = learner_of(env)
    learner.learn(200, Uses(lambda: inner.step(inner.action_space.sample())))
    learner.learn(200, Uses(inner.reset), reset_num_timesteps=False)
    assert 200 < stored(learner.replay_buffer, happened) < 400
    happened = {}
    env = environments("dummy", happened)
    single_env = env.envs[0].unwrapped
    learner = learner_of(env)
    states = []

    def goes_back():
        states.append(single_env.get_state())
        single_env.set_state(states[0])

    learner.learn(200, Uses(goes_back))
    assert 100 < stored(learner.replay_buffer, happened) < 200
    with pytest.raises(ValueError, match="took 2 steps, and the buffer was told of one"):
        learner.learn(200, Uses(lambda: single_env.step(np.zeros(4, np.float32))))
    stored(learner.replay_buffer, happened)


def test_what_vec_normalize_shows_of_another_episode_is_left_out():
    env = environments("normalized", {})
    learner = learner_of(env)
    learner.learn(10)
    buffer = learner.replay_buffer
    before = buffer._native.unfinished_steps(0)  # noqa: SLF001
    shown = learner._last_original_obs  # noqa: SLF001
    # As after an evaluation in a callback: an observation of another episode, and a reward of it.
    other = {part: numbers + 1.0 for part, numbers in shown.items()}
    infos = env.step(np.zeros((NUM_ENVS, 4), np.float32))[3]
    goes_on = np.zeros(NUM_ENVS, np.bool_)
    buffer.add(shown, other, np.zeros((NUM_ENVS, 4)), np.full(NUM_ENVS, -0.5), goes_on, infos)
    assert before == 10 // NUM_ENVS
    assert buffer.size() == 10
    assert buffer._native.unfinished_steps(0) is None  # noqa: SLF001


def test_last_observations_that_vec_normalize_clips_are_no_other_rewards():
    env = VecNormalize(sb3.FetchVecEnv("FetchReachDense-v4", NUM_ENVS), clip_obs=0.01)
    learner = learner_of(env)
    learner.learn(210)
    assert learner.replay_buffer.size() == 200


class Repeats(gymnasium.Wrapper):
    """Takes each action twice."""

    def step(self, action):
        self.env.step(action)
        return self.env.step(action)


def test_repeated_actions_are_an_error():
    env = gymnasium.make("fetch_env/FetchReach-v4")
    with pytest.raises(ValueError, match="no wrapper that repeats actions"):
        learner_of(DummyVecEnv([lambda: Repeats(env)])).learn(100)


def test_a_goal_that_is_replaced_ends_the_episode():
    happened = {}
    env = environments("dummy", happened)
    single_env = env.envs[0].unwrapped
    learner = learner_of(env)

    def replace():
        single_env.goal = single_env.goal + 0.01

    learner.learn(200, Uses(replace))
    assert stored(learner.replay_buffer, happened) == 200
    assert learner.replay_buffer._native.num_episodes > 200 / 50  # noqa: SLF001
