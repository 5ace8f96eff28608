"""SAC on Reach with Stable-Baselines3's hindsight buffer and with ours: steps, and time of parts.

The settings are those of RL Baselines3 Zoo for FetchReach. Both buffers get the same environment.
A run ends when two evaluations in a row, of 20 episodes every 250 steps, succeed in all. Each run
prints its steps, the processor's time of one thread in milliseconds for each step that is
followed by an update, and the successes of its evaluations.
"""

import argparse
import sys
import time
from collections import defaultdict

import numpy as np
import torch
from fetch_env import sb3
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecNormalize

ENV_ID = "FetchReach-v4"
LEARNING_STARTS = 1000
EVERY = 250
EPISODES = 20
STEPS = 20_000
BUFFERS = {"theirs": HerReplayBuffer, "ours": sb3.HerReplayBuffer}


class Clock:
    """Processor time of the methods that are timed."""

    def __init__(self):
        self.seconds = defaultdict(float)

    def time(self, owner, method, part):
        call = getattr(owner, method)

        def timed(*args, **kwargs):
            begin = time.process_time()
            try:
                return call(*args, **kwargs)
            finally:
                self.seconds[part] += time.process_time() - begin

        setattr(owner, method, timed)


class Evaluation(BaseCallback):
    """Evaluates now and then, and ends the run after the second success in a row."""

    def __init__(self, clock, seed):
        super().__init__()
        self.clock = clock
        self.envs = sb3.FetchVecEnv(ENV_ID, EPISODES, num_threads=1)
        self.envs.seed(10_000 * (seed + 1))
        self.envs.reset()
        self.successes = []

    @property
    def solved(self):
        return self.successes[-2:] == [1.0, 1.0]

    def success(self):
        observations = self.envs.reset()
        normalize = self.model.get_env().normalize_obs
        for _ in range(50):
            actions, _ = self.model.predict(normalize(observations), deterministic=True)
            observations, _, _, infos = self.envs.step(actions)
        return float(np.mean([info["is_success"] for info in infos]))

    def _on_step(self):
        if self.num_timesteps == LEARNING_STARTS:
            self.clock.seconds.clear()
            self.begin = time.process_time()
            self.pause = 0.0
        if self.num_timesteps <= LEARNING_STARTS or self.num_timesteps % EVERY:
            return True
        begin = time.process_time()
        self.successes.append(self.success())
        self.pause += time.process_time() - begin
        return not self.solved


def run(buffer, seed):
    """Train once, and return the steps, the milliseconds of each part and the successes."""
    env = VecNormalize(sb3.FetchVecEnv(ENV_ID, 1), gamma=0.95)
    model = SAC(
        "MultiInputPolicy",
        env,
        learning_rate=0.001,
        buffer_size=1_000_000,
        learning_starts=LEARNING_STARTS,
        batch_size=256,
        gamma=0.95,
        ent_coef="auto",
        replay_buffer_class=BUFFERS[buffer],
        replay_buffer_kwargs={"n_sampled_goal": 4, "goal_selection_strategy": "future"},
        device="cpu",
        seed=seed,
    )
    clock = Clock()
    clock.time(env.venv, "step_async", "environment")
    clock.time(env.venv, "step_wait", "environment")
    clock.time(model.replay_buffer, "add", "adding")
    clock.time(model.replay_buffer, "sample", "drawing")
    evaluation = Evaluation(clock, seed)
    model.learn(STEPS, callback=evaluation)
    total = time.process_time() - evaluation.begin - evaluation.pause
    steps = model.num_timesteps - LEARNING_STARTS
    parts = {part: 1e3 * seconds / steps for part, seconds in clock.seconds.items()}
    parts["rest"] = 1e3 * total / steps - sum(parts.values())
    return model.num_timesteps if evaluation.solved else None, parts, evaluation.successes


def main():
    """Run all seeds, the two buffers in turn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    seeds = parser.parse_args().seeds
    torch.set_num_threads(1)
    for seed in range(seeds):
        for buffer in BUFFERS if seed % 2 == 0 else reversed(BUFFERS):
            steps, parts, successes = run(buffer, seed)
            times = "  ".join(f"{part} {each:.3f}" for part, each in parts.items())
            sys.stdout.write(f"{buffer} seed {seed}: {steps} steps;  {times}\n  {successes}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
