"""Renders gymnasium-robotics after random actions, and times it.

Reads seconds from standard input, one on each line. It renders for at least as long, and answers
with the pictures done and the seconds they took, in wall time and in process time. It takes a step before
each picture, which is not timed.
"""

import argparse
import contextlib
import io
import time

import numpy as np

EPISODE = 50
SEED = 0


def make(env_id, side):
    # Their warnings are about environments that are not used here.
    with contextlib.redirect_stderr(io.StringIO()):
        import gymnasium
        import gymnasium_robotics

    gymnasium.register_envs(gymnasium_robotics)
    env = gymnasium.make(
        env_id, render_mode="rgb_array", width=side, height=side, disable_env_checker=True
    )
    env.reset(seed=SEED)
    return env


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("env_id")
    parser.add_argument("--side", type=int, default=480)
    args = parser.parse_args()
    env = make(args.env_id, args.side)
    shape = (20 * EPISODE, 4)
    actions = np.random.default_rng(1).uniform(-1, 1, shape).astype(np.float32)
    steps = 0
    print("ready", flush=True)
    while line := next(iter(input, ""), ""):
        done, wall, cpu = 0, 0.0, 0.0
        while wall < float(line):
            if steps % EPISODE == 0:
                env.reset()
            env.step(actions[steps % len(actions)])
            steps += 1
            start, start_cpu = time.perf_counter(), time.process_time()
            env.render()
            wall += time.perf_counter() - start
            cpu += time.process_time() - start_cpu
            done += 1
        print(done, wall, cpu, flush=True)


if __name__ == "__main__":
    try:
        main()
    except EOFError:
        pass
