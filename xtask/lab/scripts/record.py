"""Records trajectories of gymnasium-robotics' Fetch environments.

Needs gymnasium-robotics 1.4.2, gymnasium 1.4.0 and mujoco (3.6.0 to 4.0.0 were tried):

    python record.py --out DIR [--episodes N] [--seed S]

writes one .npz file per task and kind, in the format that `cargo xtask parity --fixtures DIR` reads:
E episodes of T steps; index 0 along T + 1 is the state after reset(seed).
"""

import argparse
import json
import math
import os
import pathlib

# numpy's own arctan2 for AVX-512 differs in the last bits, also between versions. It must call the
# C library, so that the object's Euler angles can be compared to the last bit.
os.environ.setdefault("NPY_DISABLE_CPU_FEATURES", "X86_V4")

import gymnasium
import gymnasium_robotics
import mujoco
import numpy as np

import start

STEPS = 50
TASKS = {"reach": "Reach", "push": "Push", "pick_and_place": "PickAndPlace", "slide": "Slide"}


def random_action(rng, _observation):
    return rng.uniform(-1.0, 1.0, 4)


def wild_action(rng, _observation):
    """Beyond the action space, so that clipping matters."""
    return rng.uniform(-3.0, 3.0, 4)


def chase_action(rng, observation):
    """Drives at the object, for many contacts."""
    to_object = observation["observation"][6:9]
    return np.append(20.0 * to_object, rng.uniform(-1.0, 1.0)) + rng.normal(0.0, 0.2, 4)


KINDS = {"random": random_action, "wild": wild_action, "chase": chase_action}


def arctan2_is_the_c_librarys():
    y, x = np.random.default_rng(0).normal(size=(2, 1000))
    return np.arctan2(y, x).tolist() == list(map(math.atan2, y, x))


class ContactCounter:
    """Steps the physics as the environment does, and counts contacts after every substep."""

    def __init__(self, env):
        self.env = env
        base = mujoco.mj_name2id(env.model, mujoco.mjtObj.mjOBJ_BODY, "robot0:base_link")
        bodies = (env.model.geom_bodyid[geom] for geom in range(env.model.ngeom))
        self.of_robot = [self.is_below(body, base) for body in bodies]
        self.contacts = self.self_contacts = 0
        env._mujoco_step = self.step

    def is_below(self, body, ancestor):
        while body not in (0, ancestor):
            body = self.env.model.body_parentid[body]
        return body == ancestor

    def step(self, _action):
        self.contacts = self.self_contacts = 0
        for _ in range(self.env.n_substeps):
            mujoco.mj_step(self.env.model, self.env.data)
            for contact in self.env.data.contact:
                self.contacts += 1
                self.self_contacts += self.of_robot[contact.geom1] and self.of_robot[contact.geom2]


def record_episode(env, counter, seed, act, rng):
    observation, _ = env.reset(seed=seed)
    states, steps = [], []

    def note_state():
        state = {key: observation[key].copy() for key in observation}
        states.append(state | {"qpos": env.data.qpos.copy(), "qvel": env.data.qvel.copy()})

    note_state()
    for _ in range(STEPS):
        action = act(rng, observation).astype(np.float32)
        observation, reward, _, _, info = env.step(action)
        env.reward_type = "sparse"
        sparse = env.compute_reward(observation["achieved_goal"], observation["desired_goal"], info)
        env.reward_type = "dense"
        note_state()
        steps.append({
            "actions": action,
            "reward_dense": np.float64(reward),
            "reward_sparse": np.float32(sparse),
            "is_success": np.float32(info["is_success"]),
            "contacts": np.int32(counter.contacts),
            "self_contacts": np.int32(counter.self_contacts),
        })
    return {
        key: np.stack([entry[key] for entry in entries])
        for entries in (states, steps)
        for key in entries[0]
    }


def record(task, kind, episodes, seed):
    env_id = f"Fetch{TASKS[task]}Dense-v4"
    env = gymnasium.make(env_id).unwrapped
    settled = {
        "initial_gripper_xpos": env.initial_gripper_xpos.copy(),
        "height_offset": np.array([getattr(env, "height_offset", np.nan)]),
        "initial_qpos": env.initial_qpos.copy(),
        "initial_qvel": env.initial_qvel.copy(),
    }
    counter = ContactCounter(env)
    # A different stream from the resets': equal seeds would correlate actions and goals.
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    seeds = np.arange(seed, seed + episodes, dtype=np.int64)
    recorded = [record_episode(env, counter, int(s), KINDS[kind], rng) for s in seeds]
    meta = {
        "env": env_id,
        "kind": kind,
        "gymnasium": gymnasium.__version__,
        "gymnasium_robotics": gymnasium_robotics.__version__,
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "c_arctan2": arctan2_is_the_c_librarys(),
        "workaround": start.WORKAROUND,
        "steps": STEPS,
    }
    stacked = {key: np.stack([episode[key] for episode in recorded]) for key in recorded[0]}
    return stacked | settled | {"seeds": seeds, "meta": np.array(json.dumps(meta))}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--episodes", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    for task in TASKS:
        for kind in KINDS:
            if (task, kind) != ("reach", "chase"):
                path = args.out / f"{task}-{kind}.npz"
                np.savez_compressed(path, **record(task, kind, args.episodes, args.seed))


if __name__ == "__main__":
    main()
