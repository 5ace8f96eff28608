"""Evolves a policy of Push in plain numpy, by the cross-entropy method.

Each candidate acts in worlds of its own, each with another mass and friction.
"""

import fetch_env
import numpy as np

VARIATION = {"object_mass": {"log_uniform": (0.5, 4.0)}, "friction": (0.5, 2.0)}
CANDIDATES, WORLDS, ELITE = 20, 8, 4


def act(numbers, observations):
    """Go behind the object, then down, and push: four numbers say how."""
    offset, near, approach, push = numbers.T[:, :, None]
    to_object = observations["observation"][:, 6:9]
    to_goal = (observations["desired_goal"] - observations["achieved_goal"])[:, :2]
    direction = to_goal / (np.linalg.norm(to_goal, axis=1, keepdims=True) + 0.01)
    behind = to_object[:, :2] - offset * direction
    is_there = np.linalg.norm(behind, axis=1, keepdims=True) < near
    across = approach * behind + push * is_there * to_goal
    down = 10 * (to_object[:, 2:] + 0.08 * ~is_there)
    return np.hstack([across, down, np.zeros_like(down)]).astype(np.float32)


def evolve(generations, seed=0):
    """Return the mean return of each generation, and the masses in the last one's worlds."""
    envs = fetch_env.FetchVectorEnv("FetchPushDense-v4", CANDIDATES * WORLDS, variation=VARIATION)
    random = np.random.default_rng(seed)
    mean, deviation = np.log([0.1, 0.1, 5.0, 5.0]), np.ones(4)
    curve = []
    for generation in range(generations):
        numbers = np.exp(mean + deviation * random.standard_normal((CANDIDATES, 4)))
        observations, _ = envs.reset(seed=None if generation else seed)
        returns = np.zeros((CANDIDATES, WORLDS))
        for _ in range(50):
            actions = act(numbers.repeat(WORLDS, axis=0), observations)
            observations, rewards, *_ = envs.step(actions)
            returns += rewards.reshape(returns.shape)
        elite = np.log(numbers[np.argsort(returns.mean(axis=1))[-ELITE:]])
        mean, deviation = elite.mean(axis=0), elite.std(axis=0) + 0.05
        curve.append(returns.mean())
    return curve, [varied["object_mass"] for varied in envs.get_attr("variation")]


if __name__ == "__main__":
    for generation, mean_return in enumerate(evolve(12)[0]):
        print(f"generation {generation}: mean return {mean_return:.2f}")
