"""Learn Reach by DDPG in torch, with the environments and the hindsight buffer of this package."""

import copy

import fetch_env
import gymnasium
import numpy as np
import torch
from torch import nn

GAMMA, NOISE, RANDOM, AVERAGED = 0.98, 0.2, 0.3, 0.95


def network(inputs, outputs):
    """Return a network with two hidden layers."""
    return nn.Sequential(
        nn.Linear(inputs, 128), nn.ReLU(), nn.Linear(128, 128), nn.ReLU(), nn.Linear(128, outputs)
    )


class Agent:
    """DDPG: an actor, a critic, and the slow copies of both that make the targets."""

    def __init__(self, inputs, actions):
        """Create the networks for inputs and actions of these lengths."""
        self.actor = nn.Sequential(network(inputs, actions), nn.Tanh())
        self.critic = network(inputs + actions, 1)
        self.slow_actor, self.slow_critic = copy.deepcopy(self.actor), copy.deepcopy(self.critic)
        self.optimizers = [
            torch.optim.Adam(net.parameters(), lr=1e-3) for net in (self.actor, self.critic)
        ]

    def act(self, observations):
        """Return the actions of many observations."""
        goal = observations["desired_goal"] - observations["achieved_goal"]
        inputs = np.concatenate([observations["observation"], goal], axis=-1)
        with torch.no_grad():
            return self.actor(torch.as_tensor(inputs, dtype=torch.float32)).numpy()

    def update(self, batch):
        """Take one step of the critic and of the actor."""
        names = ("input", "action", "reward", "next_input")
        inputs, actions, rewards, next_inputs = (torch.from_numpy(batch[name]) for name in names)
        with torch.no_grad():
            next_values = self.value(self.slow_critic, next_inputs, self.slow_actor(next_inputs))
            # Rewards are -1 or 0, so no return is outside.
            targets = (rewards + GAMMA * next_values).clamp(-1 / (1 - GAMMA), 0)
        critic_loss = (self.value(self.critic, inputs, actions) - targets).square().mean()
        self.step(self.optimizers[1], critic_loss)
        actions = self.actor(inputs)
        actor_loss = actions.square().mean() - self.value(self.critic, inputs, actions).mean()
        self.step(self.optimizers[0], actor_loss)

    def average(self):
        """Move the slow copies a little."""
        pairs = (self.slow_actor, self.actor), (self.slow_critic, self.critic)
        for slow, fast in pairs:
            for slow_weights, weights in zip(slow.parameters(), fast.parameters(), strict=True):
                slow_weights.data.lerp_(weights.data, 1 - AVERAGED)

    @staticmethod
    def value(critic, inputs, actions):
        """Return what a critic says of actions."""
        return critic(torch.cat([inputs, actions], dim=1)).flatten()

    @staticmethod
    def step(optimizer, loss):
        """Move a network against the gradient of its loss."""
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()


def learn(env_id="fetch_env/FetchReach-v4", num_envs=8, cycles=30, seed=0):
    """Alternate between an episode in each environment and 40 updates; return the agent."""
    torch.manual_seed(seed)
    random = np.random.default_rng(seed)
    envs = gymnasium.make_vec(env_id, num_envs)
    buffer = fetch_env.HerBuffer(envs, capacity=100_000, seed=seed)
    spaces = envs.single_observation_space
    inputs = spaces["observation"].shape[0] + spaces["desired_goal"].shape[0]
    agent = Agent(inputs, envs.single_action_space.shape[0])
    observations, _ = envs.reset(seed=seed)
    buffer.record(envs)
    for _ in range(cycles):
        for _ in range(51):  # 50 steps and the reset that autoreset takes for one
            actions = agent.act(observations)
            actions += NOISE * random.standard_normal(actions.shape)
            is_random = random.random((num_envs, 1)) < RANDOM
            actions = np.where(is_random, random.uniform(-1, 1, actions.shape), actions)
            observations, *_ = envs.step(actions.clip(-1, 1).astype(np.float32))
            buffer.record(envs)
        for _ in range(40):
            agent.update(buffer.sample(256, joined_goal="relative"))
            agent.average()
    envs.close()
    return agent


if __name__ == "__main__":
    agent = learn()
    result = fetch_env.evaluate("FetchReach-v4", agent.act, batched=True)
    print(f"success rate {result['success_rate']['value']:.2f}")
