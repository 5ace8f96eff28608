"""Records the pictures of the real Fetch environments, for `cargo xtask parity frames`.

Needs gymnasium-robotics 1.4.2 and gymnasium 1.4.0, and OpenGL. Writes one file for each task
into --out: the actions, and the frames after the reset and after some of the steps.
"""

import argparse
import copy
import os
import pathlib

os.environ.setdefault("MUJOCO_GL", "egl")

import gymnasium
import mujoco
import numpy as np

import start

TASKS = {"reach": "Reach", "push": "Push", "pick_and_place": "PickAndPlace", "slide": "Slide"}


def frame(env):
    """Renders, and undoes the changes that rendering makes to the simulation."""
    data, site_pos = copy.copy(env.data), env.model.site_pos.copy()
    picture = env.render()
    mujoco.mj_copyData(env.data, env.model, data)
    env.model.site_pos[:] = site_pos
    return picture


def record(task, seed, steps, every):
    env = gymnasium.make(f"Fetch{TASKS[task]}-v4", render_mode="rgb_array").unwrapped
    rng = np.random.default_rng([seed, 1])
    env.reset(seed=seed)
    frames, actions = [frame(env)], []
    for step in range(1, steps + 1):
        actions.append(rng.uniform(-1, 1, 4).astype(np.float32))
        env.step(actions[-1])
        if step % every == 0:
            frames.append(frame(env))
    return {
        "seed": np.int64(seed),
        "every": np.int64(every),
        "workaround": np.int64(start.WORKAROUND),
        "actions": np.stack(actions),
        "frames": np.stack(frames),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--steps", type=int, default=50)
    parser.add_argument("--every", type=int, default=5)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    for task in TASKS:
        np.savez(args.out / f"{task}.npz", **record(task, args.seed, args.steps, args.every))


if __name__ == "__main__":
    main()
