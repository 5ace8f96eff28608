"""What the tests of replay buffers share: environments, a reward, and recording."""

import fetch_env
import gymnasium
import numpy as np

STEPS = 50


def single():
    return gymnasium.make("fetch_env/FetchPush-v4")


def vector():
    return gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=2)


def flat(achieved_goal, desired_goal, info):
    """Judge x and y alone."""
    assert len(info) == len(achieved_goal)
    return -np.linalg.norm((achieved_goal - desired_goal)[..., :2], axis=-1)


def fill(envs, buffer, actions, steps=STEPS + 1):
    """Record an episode of each environment."""
    envs.reset(seed=0)
    buffer.record(envs)
    for step in range(steps):
        envs.step(actions[step : step + envs.num_envs])
        buffer.record(envs)
    return buffer


def same(one, another, but=()):
    """Assert that two batches are the same."""
    assert one.keys() == another.keys()
    for key in one.keys() - set(but):
        np.testing.assert_array_equal(one[key], another[key], err_msg=key)


class Stored:
    """Episodes of random numbers, and their transitions in the order in which they are stored."""

    def __init__(self, env=None):
        self.env = fetch_env.FetchEnv("FetchReach-v4") if env is None else env
        self.compute_reward = self.env.compute_reward
        random = np.random.default_rng(0)
        width = self.env.observation_space["observation"].shape[0]

        def normal(*shape):
            # What a buffer stores.
            return random.normal(scale=0.04, size=shape).astype(np.float32)

        self.episodes = []
        for number, steps in enumerate((7, 12, 1, 30)):
            achieved_goal, desired_goal = normal(steps + 1, 3), normal(3)
            goals = achieved_goal[1:], np.tile(desired_goal, (steps, 1))
            self.episodes.append(
                {
                    "observation": normal(steps + 1, width),
                    "achieved_goal": achieved_goal,
                    "desired_goal": desired_goal,
                    "action": normal(steps, 4),
                    "reward": self.compute_reward(*goals),
                    "terminated": number % 2 == 1,
                    "truncated": number % 2 == 0,
                }
            )
        lengths = [len(each["action"]) for each in self.episodes]
        self.episode = np.repeat(range(len(lengths)), lengths)
        self.left = np.concatenate([np.arange(length, 0, -1) for length in lengths])
        self.is_last = self.left == 1
        self.terminated = self.is_last & (self.episode % 2 == 1)
        states = [(each["observation"], each["achieved_goal"]) for each in self.episodes]
        self.observation = np.concatenate([observation[:-1] for observation, _ in states])
        self.next_observation = np.concatenate([observation[1:] for observation, _ in states])
        self.next_achieved_goal = np.concatenate([achieved[1:] for _, achieved in states])
        goals = np.array([each["desired_goal"] for each in self.episodes])
        self.desired_goal = goals[self.episode]
        self.reward = np.concatenate([each["reward"] for each in self.episodes])

    def field(self, length):
        """Return what a field of this length has in each transition."""
        return np.arange(len(self.left) * length, dtype=np.float32).reshape(-1, length)

    def buffer(self, reward=None, *, fields=None, fill=True, **settings):
        """Return a buffer that has the episodes."""
        buffer = fetch_env.HerBuffer(self.env, 1000, reward=reward, fields=fields, **settings)
        for number, episode in enumerate(self.episodes if fill else []):
            steps = self.episode == number
            values = {name: self.field(length)[steps] for name, length in (fields or {}).items()}
            buffer.add_episode(**episode, fields=values)
        return buffer
