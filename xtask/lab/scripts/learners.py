"""Learners in PyTorch and Stable-Baselines3, to compare with.

`learners.py time LAYERS` makes a DDPG learner with hidden layers of 256 units, on one thread, and
reads orders from standard input, one per line: `update COUNT WORK`; it answers with COUNT times
WORK and the seconds that COUNT updates took, in wall time and in processor time.

`learners.py reach SEED MODEL` trains Stable-Baselines3's SAC with hindsight on FetchReach-v4 until
two evaluations in a row succeed in all of 100 episodes, with the settings of RL Baselines3 Zoo,
saves the model, and prints the steps and the seconds of training, without the evaluations.
"""

import sys
import time

import torch
from torch import nn

BATCH, OBSERVATION, ACTION = 256, 28, 4
GAMMA, TARGET_FRACTION, ACTION_L2 = 0.95, 0.05, 0.05


def network(inputs, layers, outputs):
    sizes = [inputs] + [256] * layers
    modules = [m for a, b in zip(sizes, sizes[1:]) for m in (nn.Linear(a, b), nn.ReLU())]
    return nn.Sequential(*modules, nn.Linear(sizes[-1], outputs))


class Learner:
    """The update of `Ddpg`, as a user would write it in PyTorch."""

    def __init__(self, layers):
        make = lambda: (
            network(OBSERVATION, layers, ACTION),
            network(OBSERVATION + ACTION, layers, 1),
        )
        (self.actor, self.critic), self.targets = make(), make()
        self.optimizers = [
            torch.optim.Adam(net.parameters(), 1e-3, fused=True)
            for net in (self.actor, self.critic)
        ]
        self.batch = [torch.randn(BATCH, width) for width in (OBSERVATION, ACTION, 1, OBSERVATION)]

    def update(self):
        inputs, actions, rewards, next_inputs = self.batch
        target_actor, target_critic = self.targets
        with torch.no_grad():
            next_actions = torch.tanh(target_actor(next_inputs))
            values = target_critic(torch.cat([next_inputs, next_actions], 1))
            targets = (rewards + GAMMA * values).clamp(-1 / (1 - GAMMA), 0)
        loss = nn.functional.mse_loss(self.critic(torch.cat([inputs, actions], 1)), targets)
        own = torch.tanh(self.actor(inputs))
        for parameter in self.critic.parameters():
            parameter.requires_grad_(False)
        value = self.critic(torch.cat([inputs, own], 1)).mean()
        actor_loss = ACTION_L2 * (own * own).mean() - value
        for parameter in self.critic.parameters():
            parameter.requires_grad_(True)
        for optimizer, value in zip(self.optimizers, (actor_loss, loss)):
            optimizer.zero_grad(set_to_none=True)
            value.backward()
        for optimizer in self.optimizers:
            optimizer.step()
        with torch.no_grad():
            for target, net in zip(self.targets, (self.actor, self.critic)):
                parameters = list(target.parameters()), list(net.parameters())
                torch._foreach_lerp_(*parameters, TARGET_FRACTION)


def time_updates(layers):
    torch.set_num_threads(1)
    learner = Learner(layers)
    learner.update()
    print("ready", flush=True)
    while True:
        count, work = (int(number) for number in input().split()[1:])
        start, cpu = time.perf_counter(), time.process_time()
        for _ in range(count):
            learner.update()
        print(count * work, time.perf_counter() - start, time.process_time() - cpu, flush=True)


def reach(seed, path):
    import gymnasium
    import gymnasium_robotics
    from stable_baselines3 import SAC, HerReplayBuffer

    gymnasium.register_envs(gymnasium_robotics)
    # The zoo's settings for the Fetch tasks, with its networks for Reach.
    model = SAC(
        "MultiInputPolicy",
        gymnasium.make("FetchReach-v4"),
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs=dict(n_sampled_goal=4, goal_selection_strategy="future"),
        learning_starts=1000,
        learning_rate=1e-3,
        batch_size=256,
        gamma=0.95,
        tau=0.05,
        policy_kwargs=dict(net_arch=[256, 256]),
        seed=seed,
    )
    env, seconds, in_a_row = gymnasium.make("FetchReach-v4"), 0.0, 0
    print("ready", flush=True)
    while in_a_row < 2:
        start = time.perf_counter()
        model.learn(500, reset_num_timesteps=False)
        seconds += time.perf_counter() - start
        successes = 0
        for episode in range(100):
            observation, _ = env.reset(seed=2**30 + episode)
            truncated = False
            while not truncated:
                action, _ = model.predict(observation, deterministic=True)
                observation, _, _, truncated, info = env.step(action)
            successes += info["is_success"]
        in_a_row = in_a_row + 1 if successes == 100 else 0
        seen = f"after {model.num_timesteps} steps, {seconds:.1f} s: {successes:.0f}"
        print(seen, file=sys.stderr)
    model.save(path)
    print(model.num_timesteps, seconds, seconds, flush=True)


if __name__ == "__main__":
    command, *arguments = sys.argv[1:]
    try:
        if command == "time":
            time_updates(int(arguments[0]))
        else:
            reach(int(arguments[0]), arguments[1])
    except EOFError:
        pass
