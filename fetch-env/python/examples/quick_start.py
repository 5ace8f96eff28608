"""Step one environment and many, learn Reach, and use the policy."""

import fetch_env
import gymnasium
import numpy as np


def random_episode():
    """Return the rewards of an episode of random actions, and what its last reward should be."""
    env = gymnasium.make("fetch_env/FetchPush-v4")
    env.action_space.seed(0)
    observation, info = env.reset(seed=0)
    rewards, truncated = [], False
    while not truncated:
        observation, reward, _, truncated, info = env.step(env.action_space.sample())
        rewards.append(reward)
    # A reward follows from two goals, so hindsight can compute that of any other goal.
    achieved, desired = observation["achieved_goal"], observation["desired_goal"]
    last = env.unwrapped.compute_reward(achieved, desired, info)
    env.close()
    return rewards, last


def learn():
    """Train on Reach until it always succeeds, and return the policy's evaluation."""
    training = fetch_env.train("FetchReach-v4", target=1.0, progress=False)
    return training, fetch_env.evaluate("FetchReach-v4", training.policy, episodes=100)


def act(policy, num_envs):
    """Let a policy act in many environments, and return who succeeded at the end."""
    envs = gymnasium.make_vec("fetch_env/FetchReach-v4", num_envs)
    observations, infos = envs.reset(seed=1)
    for _ in range(50):
        observations, _, _, _, infos = envs.step(policy(observations))
    envs.close()
    return np.asarray(infos["is_success"], bool)


if __name__ == "__main__":
    rewards, last = random_episode()
    print(f"random actions in Push: return {sum(rewards):.0f}, the last reward {last:.0f}")
    training, result = learn()
    rate, steps = result["success_rate"]["value"], training.curve[-1]["counters"]["steps"]
    print(f"Reach after {steps:,} steps: success rate {rate:.2f}")
    print(f"in 16 environments at once: {act(training.policy, 16).mean():.2f}")
