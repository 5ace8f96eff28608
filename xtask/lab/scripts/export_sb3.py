"""Exports the actor of a Stable-Baselines3 model to a file that `baselines::TrainedPolicy` loads.

    python export_sb3.py MODEL.zip POLICY.safetensors --env-id FetchReach-v4

MODEL.zip is one of SAC, TD3 or DDPG with `MultiInputPolicy` and rectified linear units, as
`model.save()` writes it. Needs stable-baselines3 and safetensors.
"""

import argparse
import json

import numpy as np
from safetensors.numpy import save_file
from stable_baselines3 import DDPG, SAC, TD3
from torch import nn

ALGORITHMS = {"sac": SAC, "td3": TD3, "ddpg": DDPG}


def layers_of(model):
    """The linear layers of the actor, without the tanh after the last."""
    actor = model.policy.actor
    modules = [*actor.latent_pi, actor.mu] if hasattr(actor, "latent_pi") else list(actor.mu)
    activations = [module for module in modules if not isinstance(module, (nn.Linear, nn.Tanh))]
    if not all(isinstance(module, nn.ReLU) for module in activations):
        raise SystemExit(f"hidden layers must have rectified linear units, not {activations}")
    return [module for module in modules if isinstance(module, nn.Linear)]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("model")
    parser.add_argument("policy")
    parser.add_argument("--env-id", required=True)
    parser.add_argument("--algorithm", choices=ALGORITHMS, default="sac")
    args = parser.parse_args()

    # A replay buffer is not needed, and one with hindsight would need the environment.
    no_buffer = dict(replay_buffer_class=None, replay_buffer_kwargs={}, buffer_size=1)
    model = ALGORITHMS[args.algorithm].load(args.model, device="cpu", custom_objects=no_buffer)
    spaces = model.observation_space.spaces
    header = dict(
        version=1,
        env_id=args.env_id,
        observation_len=spaces["observation"].shape[0],
        goal_len=spaces["desired_goal"].shape[0],
        action_len=model.action_space.shape[0],
        # The order in which Stable-Baselines3 joins them.
        inputs=list(spaces),
        observation_normalizer=None,
        goal_normalizer=None,
        algorithm=f"stable-baselines3 {args.algorithm}",
        settings=dict(gamma=model.gamma, batch_size=model.batch_size),
        seed=model.seed or 0,
        steps=model.num_timesteps,
        demonstrations=0,
        success=None,
    )
    tensors = {}
    for number, layer in enumerate(layers_of(model)):
        weight = layer.weight.detach().numpy().T
        tensors[f"layers.{number}.weight"] = np.ascontiguousarray(weight, np.float32)
        tensors[f"layers.{number}.bias"] = layer.bias.detach().numpy().astype(np.float32)
    save_file(tensors, args.policy, metadata={"policy": json.dumps(header)})


if __name__ == "__main__":
    main()
