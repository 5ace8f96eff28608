"""Stable-Baselines3's hindsight buffer: how fast it is, and what it samples.

`sb3.py time N` fills a buffer with N transitions of float64 (observation 25, goals 3, action 4,
episodes of 50 steps), then reads orders from standard input, one per line: `sample SIZE BATCHES` (a
step is added after each batch) or `add STEPS`; it answers with the rows done and the seconds they
took, in wall time and in processor time.

`sb3.py sample EPISODES OUT --rows N` fills a buffer with the episodes of an archive, as
`HerBuffer::export_npz` writes them, and writes a batch of N rows for each strategy.
"""

import argparse
import time

import gymnasium
import numpy as np
import torch
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.vec_env import DummyVecEnv

K = 4
STEPS = 50
THRESHOLD = 0.05


class GoalTask(gymnasium.Env):
    """The sparse reward, with the spaces; it is never stepped."""

    def __init__(self, observation, goal, action):
        box = lambda size: gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float64)
        self.observation_space = gymnasium.spaces.Dict(
            observation=box(observation), achieved_goal=box(goal), desired_goal=box(goal)
        )
        self.action_space = gymnasium.spaces.Box(-1, 1, (action,), np.float32)

    def compute_reward(self, achieved_goal, desired_goal, infos):
        distance = np.linalg.norm(achieved_goal - desired_goal, axis=-1)
        return -(distance > THRESHOLD).astype(np.float32)


def make_buffer(transitions, dims, strategy="future"):
    env = DummyVecEnv([lambda: GoalTask(*dims)])
    return HerReplayBuffer(
        transitions,
        env.observation_space,
        env.action_space,
        env=env,
        device="cpu",
        n_envs=1,
        n_sampled_goal=K,
        goal_selection_strategy=strategy,
    )


def add(buffer, episode, step):
    observations, achieved_goals, desired_goal, actions, rewards, terminated = episode
    state = lambda at: {
        "observation": observations[at][None],
        "achieved_goal": achieved_goals[at][None],
        "desired_goal": desired_goal[None],
    }
    is_last = step + 1 == len(actions)
    infos = [{"TimeLimit.truncated": is_last and not terminated}]
    buffer.add(
        state(step),
        state(step + 1),
        actions[step][None],
        rewards[step : step + 1],
        np.array([is_last]),
        infos,
    )


def random_episodes(count):
    random = np.random.default_rng(0)
    for _ in range(count):
        yield (
            random.uniform(-1, 1, (STEPS + 1, 25)),
            np.cumsum(random.uniform(-0.03, 0.03, (STEPS + 1, 3)), axis=0),
            random.uniform(-0.15, 0.15, 3),
            random.uniform(-1, 1, (STEPS, 4)).astype(np.float32),
            np.full(STEPS, -1.0, np.float32),
            False,
        )


def time_orders(transitions):
    torch.set_num_threads(1)
    buffer = make_buffer(transitions, (25, 3, 4))
    episodes = list(random_episodes(64))
    added = 0

    def add_next():
        nonlocal added
        add(buffer, episodes[added // STEPS % len(episodes)], added % STEPS)
        added += 1

    for _ in range(transitions):
        add_next()
    print("ready", flush=True)
    while True:
        order, *numbers = input().split()
        numbers = [int(number) for number in numbers]
        start, cpu = time.perf_counter(), time.process_time()
        if order == "sample":
            size, batches = numbers
            for _ in range(batches):
                buffer.sample(size)
                add_next()
            done = size * batches
        else:
            (done,) = numbers
            for _ in range(done):
                add_next()
        print(done, time.perf_counter() - start, time.process_time() - cpu, flush=True)


def read_episodes(path):
    data = np.load(path)
    ends = np.cumsum(data["episode_lengths"])
    for at, (end, length) in enumerate(zip(ends, data["episode_lengths"])):
        states = slice(end - length + at, end + at + 1)
        steps = slice(end - length, end)
        yield (
            data["observations"][states],
            data["achieved_goals"][states],
            data["desired_goals"][at],
            data["actions"][steps],
            data["rewards"][steps],
            bool(data["terminated"][at]),
        )


def sample_all(path, out, rows):
    np.random.seed(0)
    episodes = list(read_episodes(path))
    dims = episodes[0][0].shape[1], episodes[0][1].shape[1], episodes[0][3].shape[1]
    columns = {}
    for strategy in ["future", "final", "episode"]:
        buffer = make_buffer(sum(len(episode[3]) for episode in episodes), dims, strategy)
        for episode in episodes:
            for step in range(len(episode[3])):
                add(buffer, episode, step)
        batch = buffer.sample(rows)
        columns |= {
            f"{strategy}_observation": batch.observations["observation"],
            f"{strategy}_desired_goal": batch.observations["desired_goal"],
            f"{strategy}_next_desired_goal": batch.next_observations["desired_goal"],
            f"{strategy}_next_achieved_goal": batch.next_observations["achieved_goal"],
            f"{strategy}_reward": batch.rewards[:, 0],
            f"{strategy}_terminated": batch.dones[:, 0],
        }
    np.savez(out, **{name: column.numpy().astype(np.float64) for name, column in columns.items()})


def main():
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers(dest="command", required=True)
    timing = commands.add_parser("time")
    timing.add_argument("transitions", type=int)
    sampling = commands.add_parser("sample")
    sampling.add_argument("episodes")
    sampling.add_argument("out")
    sampling.add_argument("--rows", type=int, default=100_000)
    args = parser.parse_args()
    if args.command == "time":
        time_orders(args.transitions)
    else:
        sample_all(args.episodes, args.out, args.rows)


if __name__ == "__main__":
    try:
        main()
    except EOFError:
        pass
