"""Write ``sb3.json``: an update of Stable-Baselines3's PPO, to compare ours with.

It needs stable-baselines3 2.9.2. Run it in this folder.
"""

import json
from pathlib import Path

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import DummyVecEnv

NUM_INPUTS, NUM_ACTIONS, NUM_STEPS = 5, 2, 12
SETTINGS = {
    "hidden": [6, 5],
    "learning_rate": 0.001,
    "gamma": 0.9,
    "gae_lambda": 0.8,
    "epochs": 6,
    "minibatches": 1,
    "clip_range": 0.01,
    "entropy_weight": 0.01,
    "value_weight": 0.5,
    "max_gradient_norm": 1.5,
}


class Scripted(gymnasium.Env):
    """An environment of random numbers that remembers its steps."""

    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (NUM_INPUTS,))
    # No action is as large as that.
    action_space = gymnasium.spaces.Box(-1e3, 1e3, (NUM_ACTIONS,))

    def __init__(self, seed, terminated_at, truncated_at):
        self.rng = np.random.default_rng(seed)
        self.terminated_at, self.truncated_at = terminated_at, truncated_at
        self.steps = []

    def observe(self):
        self.observation = self.rng.normal(size=NUM_INPUTS).astype(np.float32)
        return self.observation

    def reset(self, **_):
        return self.observe(), {}

    def step(self, action):
        before, number = self.observation, len(self.steps)
        reward = float(np.float32(-self.rng.random()))
        terminated, truncated = number == self.terminated_at, number == self.truncated_at
        is_last = terminated or truncated or number == NUM_STEPS - 1
        discount = 0.0 if terminated else SETTINGS["gamma"]
        self.steps.append((before, action, reward, discount, self.observe(), is_last))
        return self.observation, reward, terminated, truncated, {}


def parameters(policy, get):
    """Return parts of all parameters in the order of ours: weights with a row for each input."""

    def of(layers):
        parts = [part for layer in layers for part in (get(layer.weight).T, get(layer.bias))]
        return np.concatenate([part.ravel() for part in parts])

    extractor = policy.mlp_extractor
    return {
        "actor": of([*list(extractor.policy_net)[::2], policy.action_net]),
        "deviations": get(policy.log_std),
        "critic": of([*list(extractor.value_net)[::2], policy.value_net]),
    }


def numbers(array):
    return [float(number) for number in np.asarray(array).ravel()]


def values_of(policy):
    values = parameters(policy, lambda parameter: parameter.detach().numpy())
    return {name: numbers(array) for name, array in values.items()}


def main():
    # The first episode of one environment is cut off, and that of the other ends.
    envs = [Scripted(1, None, 5), Scripted(2, 8, None)]
    model = PPO(
        "MlpPolicy",
        DummyVecEnv([lambda env=env: env for env in envs]),
        n_steps=NUM_STEPS,
        batch_size=NUM_STEPS * len(envs),
        n_epochs=SETTINGS["epochs"],
        learning_rate=SETTINGS["learning_rate"],
        gamma=SETTINGS["gamma"],
        gae_lambda=SETTINGS["gae_lambda"],
        clip_range=SETTINGS["clip_range"],
        ent_coef=SETTINGS["entropy_weight"],
        vf_coef=SETTINGS["value_weight"],
        max_grad_norm=SETTINGS["max_gradient_norm"],
        policy_kwargs={
            "net_arch": SETTINGS["hidden"],
            "activation_fn": torch.nn.ReLU,
            "ortho_init": False,
            # The denominator of our Adam, and of PyTorch's.
            "optimizer_kwargs": {"eps": 1e-8},
        },
        seed=6,
        device="cpu",
    )
    model.set_logger(configure(None, []))
    policy, update = model.policy, {"settings": SETTINGS}

    clip = torch.nn.utils.clip_grad_norm_

    def clip_and_keep(*arguments, **keywords):
        gradient = parameters(policy, lambda parameter: parameter.grad.numpy().copy())
        update.setdefault("gradients", []).append(numbers(np.concatenate([*gradient.values()])))
        return clip(*arguments, **keywords)

    torch.nn.utils.clip_grad_norm_ = clip_and_keep
    train = model.train

    def keep_and_train():
        update["before"] = values_of(policy)
        train()
        update["after"] = values_of(policy)

    model.train = keep_and_train
    # The actor before the update, for the noise of its actions.
    before = {name: tensor.clone() for name, tensor in policy.state_dict().items()}
    model.learn(NUM_STEPS * len(envs))

    policy.load_state_dict(before)
    steps = [step for env in envs for step in env.steps]
    inputs, actions, rewards, discounts, next_inputs, ends = map(list, zip(*steps, strict=True))
    with torch.no_grad():
        normal = policy.get_distribution(torch.tensor(np.array(inputs))).distribution
        noise = (torch.tensor(np.array(actions)) - normal.mean) / normal.stddev
    logged = model.logger.name_to_value
    update |= {
        "input": numbers(inputs),
        "noise": numbers(noise),
        "reward": rewards,
        "discount": discounts,
        "next_input": numbers(next_inputs),
        "is_last": ends,
        "advantage": numbers(model.rollout_buffer.advantages),
        "critic_loss": float(logged["train/value_loss"]),
        "actor_loss": float(logged["train/policy_gradient_loss"]),
        "kl": float(logged["train/approx_kl"]),
        "clip_fraction": float(logged["train/clip_fraction"]),
    }
    lines = (f"{json.dumps(name)}: {json.dumps(value)}" for name, value in update.items())
    Path("sb3.json").write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    main()
