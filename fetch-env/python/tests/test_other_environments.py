"""The replay buffer with goal-conditioned environments of other packages."""

import copy
import pickle

import fetch_env
import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector import SyncVectorEnv


class Line(gymnasium.Env):
    """A point on a line, which an action moves towards a goal."""

    observation_space = spaces.Dict(
        {
            "observation": spaces.Box(-9, 9, (2,)),
            "achieved_goal": spaces.Box(-9, 9, (1,)),
            "desired_goal": spaces.Box(-9, 9, (1,)),
            "velocity": spaces.Box(-1, 1, (1,)),
        }
    )
    action_space = spaces.Box(-1, 1, (1,))

    def reset(self, *, seed=None, options=None):  # noqa: ARG002
        super().reset(seed=seed)
        self.at, self.goal = 0.0, float(self.np_random.uniform(-3, 3))
        return self._observe(0.0), {}

    def step(self, action):
        self.at += 0.5 * float(action[0])
        seen = self._observe(action[0])
        goals = seen["achieved_goal"], seen["desired_goal"]
        reward, terminated = self.compute_reward(*goals, {}), self.compute_terminated(*goals, {})
        return seen, float(reward), bool(terminated), False, {}

    def _observe(self, velocity):
        parts = [self.at, velocity], [self.at], [self.goal], [velocity]
        keys = "observation", "achieved_goal", "desired_goal", "velocity"
        return {key: np.array(part, np.float32) for key, part in zip(keys, parts, strict=True)}

    def compute_reward(self, achieved_goal, desired_goal, info):
        del info
        return -np.abs(achieved_goal - desired_goal)[..., 0]

    def compute_terminated(self, achieved_goal, desired_goal, info):
        del info
        return np.abs(achieved_goal - desired_goal)[..., 0] < 0.3


#: A line along y, which a mirror at 0.5 turns around.
MIRROR = {"observation": "Yy", "goal": "Y", "action": "y", "center": (0, 0.5)}


def line():
    return gymnasium.wrappers.TimeLimit(Line(), 20)


def fill(env, buffer, episodes):
    """Add episodes of random actions."""
    env.action_space.seed(0)
    for seed in range(episodes):
        observation, _ = env.reset(seed=seed)
        buffer.begin_episode(observation)
        ended = False
        while not ended:
            action = env.action_space.sample()
            observation, reward, terminated, truncated, _ = env.step(action)
            buffer.add_step(action, observation, reward, terminated=terminated, truncated=truncated)
            ended = terminated or truncated
    return buffer


def law(env, batch):
    """Check that all rewards are those of the row's goals."""
    goals = batch["next_achieved_goal"], batch["desired_goal"]
    rewards = env.get_wrapper_attr("compute_reward")(*goals, {})
    np.testing.assert_allclose(batch["reward"], rewards, rtol=0, atol=1e-6)
    return goals


def test_rewards_and_terminations_are_the_environments():
    env = line()
    buffer = fill(env, fetch_env.HerBuffer(env, 1000, seed=0), 20)
    batch = buffer.sample(2000)
    assert {key: part.shape[1:] for key, part in batch.items() if part.ndim > 1} == {
        "observation": (2,),
        "next_observation": (2,),
        "achieved_goal": (1,),
        "next_achieved_goal": (1,),
        "desired_goal": (1,),
        "action": (1,),
    }
    assert 0.75 < batch["relabeled"].mean() < 0.85
    law(env, batch)
    np.testing.assert_array_equal(batch["observation"][:, :1], batch["achieved_goal"])
    batch = buffer.sample(2000, termination="recomputed")
    goals = law(env, batch)
    relabeled = batch["relabeled"]
    expected = env.unwrapped.compute_terminated(*goals, {})
    np.testing.assert_array_equal(batch["terminated"][relabeled], expected[relabeled])
    assert 0 < expected[relabeled].mean() < 1


def test_it_is_kept_and_copied(tmp_path):
    env = line()
    buffer = fill(env, fetch_env.HerBuffer(env, 1000, seed=0), 5)
    buffer.save(tmp_path / "buffer")
    loaded = fetch_env.HerBuffer(env, 1000)
    loaded.load(tmp_path / "buffer")
    expected = buffer.sample(64, seed=3)
    for other in (loaded, copy.deepcopy(buffer), pickle.loads(pickle.dumps(buffer))):
        for key, part in other.sample(64, seed=3).items():
            np.testing.assert_array_equal(part, expected[key])
    with pytest.raises(ValueError, match=r"transitions of another kind .*Line.*FetchReach-v4"):
        fetch_env.HerBuffer(fetch_env.FetchEnv("FetchReach-v4"), 1000).load(tmp_path / "buffer")


def test_wrappers_and_vectors_judge_as_they_do():
    class Halves(gymnasium.Wrapper):
        def compute_reward(self, *arguments):
            return 0.5 * self.env.unwrapped.compute_reward(*arguments)

    env = Halves(line())
    law(env, fill(line(), fetch_env.HerBuffer(env, 1000), 5).sample(64, recomputed_rewards=True))
    envs = SyncVectorEnv([line, line])
    buffer = fetch_env.HerBuffer(envs, 1000)
    law(line(), fill(line(), buffer, 5).sample(64))
    assert buffer.unfinished_steps(env_index=1) is None
    with pytest.raises(TypeError, match="only a FetchVectorEnv can be recorded"):
        buffer.record(envs)
    with pytest.raises(ValueError, match=r"TransformReward has rewards of its own.* pass reward="):
        fetch_env.HerBuffer(gymnasium.wrappers.TransformReward(line(), abs), 1000)


def test_mirrored_rows_are_mirror_images():
    env = line()
    buffer = pickle.loads(pickle.dumps(fill(env, fetch_env.HerBuffer(env, 1000, mirror=MIRROR), 9)))
    plain, mirrored = buffer.sample(256, seed=1), buffer.sample(256, seed=1, mirrored=1.0)
    np.testing.assert_allclose(mirrored["achieved_goal"], 1.0 - plain["achieved_goal"], atol=1e-6)
    np.testing.assert_array_equal(mirrored["observation"][:, 1], -plain["observation"][:, 1])
    np.testing.assert_array_equal(mirrored["action"], -plain["action"])
    goals = mirrored["next_achieved_goal"], mirrored["desired_goal"]
    np.testing.assert_allclose(mirrored["reward"], Line().compute_reward(*goals, None), atol=1e-6)


def test_what_it_cannot_hold_is_refused():
    with pytest.raises(TypeError, match="CartPole-v1 is not goal-conditioned"):
        fetch_env.HerBuffer(gymnasium.make("CartPole-v1"), 1000)

    class Changed(Line):
        def __init__(self, **parts):
            self.observation_space = spaces.Dict({**Line.observation_space, **parts})

    picture = spaces.Box(0, 255, (8, 8, 3), np.uint8)
    with pytest.raises(TypeError, match=r"observation of Changed is in Box\(0, 255, \(8, 8, 3\)"):
        fetch_env.HerBuffer(Changed(observation=picture), 1000)
    with pytest.raises(TypeError, match=r"shapes \(1,\) and \(2,\)"):
        fetch_env.HerBuffer(Changed(desired_goal=spaces.Box(-9, 9, (2,))), 1000)

    class Silent(Line):
        @property
        def compute_reward(self):
            raise AttributeError

    with pytest.raises(ValueError, match="no compute_reward here: pass reward="):
        fetch_env.HerBuffer(Silent(), 1000)
    buffer = fill(line(), fetch_env.HerBuffer(line(), 1000), 2)
    for settings in ({"success": True}, {"keep_already_achieved": 0.5}):
        with pytest.raises(ValueError, match="only Fetch tasks have a distance threshold"):
            buffer.sample(8, **settings)
    with pytest.raises(ValueError, match="nothing says how this environment looks in a mirror"):
        buffer.sample(8, mirrored=0.5)
    with pytest.raises(ValueError, match="observation has 1 letters: pass one for each of its 2"):
        fetch_env.HerBuffer(line(), 1000, mirror={**MIRROR, "observation": "Y"})
    with pytest.raises(ValueError, match="mirror is for the environments of other packages"):
        fetch_env.HerBuffer(fetch_env.FetchEnv("FetchPush-v4"), 1000, mirror=MIRROR)
    with pytest.raises(ValueError, match="up to 20 steps"):
        fetch_env.HerBuffer(line(), 19)


@pytest.mark.parametrize(
    ("env_id", "goal_len"),
    [("PointMaze_UMaze-v3", 2), ("AntMaze_UMaze-v5", 2), ("HandReach-v3", 15)],
)
def test_environments_of_gymnasium_robotics_keep_the_law(env_id, goal_len):
    gymnasium.register_envs(pytest.importorskip("gymnasium_robotics"))
    env = gymnasium.make(env_id, max_episode_steps=30)
    buffer = fill(env, fetch_env.HerBuffer(env, 1000), 4)
    batch = buffer.sample(500)
    law(env, batch)
    assert batch["desired_goal"].shape == (500, goal_len)
    assert batch["relabeled"].any()
