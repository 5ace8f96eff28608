"""Runs policies that `cargo xtask train` or `export_sb3.py` wrote in the real Fetch environments.

    python policies.py --out DIR POLICY.safetensors...  [--episodes N] [--seed S]

writes 0.npz, 1.npz, ..., one for each policy: whether the last step of each episode was a success, the
distance after it and the actions. Needs gymnasium-robotics. The network is computed in the order of
operations of `baselines::TrainedPolicy`, so that the actions have the same bits.
"""

import argparse
import json
import math
import pathlib

import gymnasium
import numpy as np

import start  # registers the environments


class Policy:
    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        length = int.from_bytes(data[:8], "little")
        tensors = json.loads(data[8 : 8 + length])
        self.header = json.loads(tensors.pop("__metadata__")["policy"])
        read = lambda name: np.frombuffer(
            data[8 + length :][slice(*tensors[name]["data_offsets"])], "<f4"
        ).reshape(tensors[name]["shape"])
        self.layers = [
            (read(f"layers.{number}.weight"), read(f"layers.{number}.bias"))
            for number in range(len(tensors) // 2)
        ]

    def normalized(self, part, numbers):
        """A part of the network's input, as `her_relabel::Normalizer` scales it."""
        kind = "observation" if part == "observation" else "goal"
        scale = self.header[f"{kind}_normalizer"]
        if scale is not None:
            std = np.sqrt(np.array(scale["squares"]) / scale["count"])
            factors = 1.0 / np.maximum(std, scale["min_std"])
            clip = scale["clip"]
            numbers = np.clip((numbers - np.array(scale["mean"])) * factors, -clip, clip)
        return numbers.astype(np.float32)

    def act(self, observation):
        parts = observation | {
            "relative_goal": observation["desired_goal"] - observation["achieved_goal"]
        }
        inputs = self.header["inputs"]
        values = np.concatenate([self.normalized(part, parts[part]) for part in inputs])
        for number, (weights, biases) in enumerate(self.layers):
            outputs = biases.copy()
            for row, value in zip(weights, values):
                outputs += row * value
            if number < len(self.layers) - 1:
                outputs = np.maximum(outputs, np.float32(0))
            values = outputs
        return np.array([math.tanh(value) for value in values], np.float32)


def run(policy, env, seed):
    observation, _ = env.reset(seed=seed)
    truncated, actions = False, []
    while not truncated:
        actions.append(policy.act(observation))
        observation, _, _, truncated, info = env.step(actions[-1])
    # Along an axis, as the environment's own distance: without one, numpy sums in another order.
    distance = np.linalg.norm(observation["achieved_goal"] - observation["desired_goal"], axis=-1)
    return bool(info["is_success"]), distance, actions


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("policies", nargs="+")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    for number, path in enumerate(args.policies):
        policy = Policy(path)
        env = gymnasium.make(policy.header["env_id"])
        seeds = range(args.seed, args.seed + args.episodes)
        successes, distances, actions = zip(*(run(policy, env, seed) for seed in seeds))
        np.savez(
            args.out / f"{number}.npz",
            success=np.array(successes, np.float64),
            final_distance=np.array(distances),
            actions=np.array(actions, np.float32),
        )


if __name__ == "__main__":
    main()
