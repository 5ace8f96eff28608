"""The buffer for Stable-Baselines3 with environments of other packages."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

pytest.importorskip("stable_baselines3")

from fetch_env import sb3
from stable_baselines3 import DQN, SAC
from stable_baselines3.common.envs import BitFlippingEnv
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize


class Plane(gymnasium.Env):
    """A point in a plane, with two parts of observations more."""

    observation_space = spaces.Dict(
        {
            "achieved_goal": spaces.Box(-9, 9, (2,)),
            "desired_goal": spaces.Box(-9, 9, (2,)),
            "matrix": spaces.Box(-9, 9, (2, 3)),
            "observation": spaces.Box(-9, 9, (2,)),
            "velocity": spaces.Box(-1, 1, (2,)),
        }
    )
    action_space = spaces.Box(-1, 1, (2,))

    def reset(self, *, seed=None, options=None):  # noqa: ARG002
        super().reset(seed=seed)
        self.at, self.goal = np.zeros(2), self.np_random.uniform(-3, 3, 2)
        return self._observe(np.zeros(2)), {}

    def step(self, action):
        self.at = self.at + 0.5 * action
        seen = self._observe(action)
        reward = self.compute_reward(seen["achieved_goal"], seen["desired_goal"], {})
        return seen, float(reward), False, False, {}

    def _observe(self, velocity):
        parts = {
            "achieved_goal": self.at,
            "desired_goal": self.goal,
            "matrix": np.tile(self.at, (3, 1)).T,
            "observation": -self.at,
            "velocity": velocity,
        }
        return {key: part.astype(np.float32) for key, part in parts.items()}

    def compute_reward(self, achieved_goal, desired_goal, info):
        del info
        return -np.linalg.norm(achieved_goal - desired_goal, axis=-1)


def plane():
    return gymnasium.wrappers.TimeLimit(Plane(), 20)


def learner_of(env, algorithm=SAC, **settings):
    return algorithm(
        "MultiInputPolicy",
        env,
        replay_buffer_class=sb3.HerReplayBuffer,
        replay_buffer_kwargs=settings,
        learning_starts=100,
        policy_kwargs={"net_arch": [8]},
        device="cpu",
        seed=0,
    )


@pytest.mark.parametrize("wrap", [VecNormalize, lambda env: env])
def test_all_parts_come_back(tmp_path, wrap):
    learner = learner_of(wrap(DummyVecEnv([plane] * 2)))
    learner.learn(320)  # whole episodes
    learner.save_replay_buffer(tmp_path / "buffer.pkl")
    learner.load_replay_buffer(tmp_path / "buffer.pkl")
    learner.learn(100)
    batch = learner.replay_buffer.sample(500)
    for parts in (batch.observations, batch.next_observations):
        at = parts["achieved_goal"].numpy()
        assert {key: tuple(part.shape[1:]) for key, part in parts.items()} == {
            key: part.shape for key, part in Plane.observation_space.items()
        }
        np.testing.assert_array_equal(parts["observation"].numpy(), -at)
        np.testing.assert_array_equal(parts["matrix"].numpy(), np.stack([at] * 3, axis=-1))
    now, after = (
        parts["achieved_goal"].numpy() for parts in (batch.observations, batch.next_observations)
    )
    np.testing.assert_allclose(after - now, 0.5 * batch.actions.numpy(), atol=1e-5)
    goal = batch.next_observations["desired_goal"].numpy()
    distances = np.linalg.norm(after - goal, axis=-1)
    np.testing.assert_allclose(batch.rewards.numpy()[:, 0], -distances, atol=1e-5)
    assert 0.1 < np.mean(distances < 1.0) < 1.0


def test_bits_are_flipped():
    env = BitFlippingEnv(n_bits=4, continuous=False, max_steps=4)
    learner = learner_of(env, DQN)
    learner.learn(400)
    batch = learner.replay_buffer.sample(100)
    flips = batch.observations["observation"] != batch.next_observations["observation"]
    assert (flips.sum(dim=1) == 1).all()
    assert (flips.float().argmax(dim=1) == batch.actions[:, 0]).all()
    reached = (batch.next_observations["achieved_goal"] == batch.observations["desired_goal"]).all(
        1
    )
    assert (batch.rewards[:, 0] == reached.float() - 1).all()
    assert reached.any()


class Seen(gymnasium.ObservationWrapper):
    """Adds a picture."""

    def __init__(self, env):
        super().__init__(env)
        picture = spaces.Box(0, 255, (36, 36, 3), np.uint8)
        self.observation_space = spaces.Dict({**env.observation_space, "picture": picture})

    def observation(self, observation):
        return {**observation, "picture": np.zeros((36, 36, 3), np.uint8)}


def test_what_it_cannot_store_is_said_when_it_is_made():
    with pytest.raises(TypeError, match=r"picture is in Box\(.*no images: use Stable-Baselines3"):
        learner_of(Seen(plane()))
    with pytest.raises(ValueError, match="a wrapper has rewards of its own"):
        learner_of(gymnasium.wrappers.TransformReward(plane(), abs))
    learner = learner_of(plane())
    with pytest.raises(ValueError, match="transitions of another kind"):
        learner.replay_buffer.set_env(sb3.FetchVecEnv("FetchReach-v4"))
    with pytest.raises(ValueError, match="only Fetch tasks have a distance threshold"):
        learner_of(plane(), keep_already_achieved=0.5)
