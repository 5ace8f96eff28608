"""Write a data set of Reach, and learn a policy from it by regression, without an environment."""

import tempfile

import fetch_env
import numpy as np


def write(folder, episodes):
    """Write episodes of a trained policy with noise in OGBench's format, and return them."""
    fetch_env.write_dataset(
        "FetchReach-v4", "expert-noisy", folder, "ogbench", episodes=episodes, seed=0
    )
    name = "fetch-reach-expert-noisy-v0"
    with np.load(f"{folder}/{name}/{name}.npz") as data:
        return dict(data)


def features(observation, achieved_goal, desired_goal):
    """Return what the policy sees: velocities, the way to the goal, and a constant."""
    way = desired_goal - achieved_goal
    return np.concatenate([way, observation[:, 5:], np.ones_like(way[:, :1])], axis=-1)


def clone(data):
    """Return the linear policy that is the nearest one to the data's actions."""
    parts = (data[name] for name in ("observations", "achieved_goals", "desired_goals"))
    weights, *_ = np.linalg.lstsq(features(*parts), data["actions"], rcond=None)

    def act(observations):
        names = ("observation", "achieved_goal", "desired_goal")
        return (features(*(observations[name] for name in names)) @ weights).clip(-1, 1)

    return act


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        data = write(folder, episodes=200)
    result = fetch_env.evaluate("FetchReach-v4", clone(data), batched=True)
    print(f"{len(data['actions']):,} rows, success rate {result['success_rate']['value']:.2f}")
