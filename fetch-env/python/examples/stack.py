"""Stack two blocks: a task that adds a block to the scene and has its own reward."""

import fetch_env
import gymnasium
import numpy as np

EDGE = 0.05  # of a block, in meters
BLOCKS = ("object0", "object1")


def are_there(achieved_goal, desired_goal):
    """Return which of the two blocks are within 3 cm of their places: (N, 2)."""
    apart = np.reshape(achieved_goal - desired_goal, (-1, 2, 3))
    return np.linalg.norm(apart, axis=-1) < 0.03


class Stack:
    """Put the second block on the first one.

    A goal has 6 elements, in meters: the places of the lower block and of the upper one.
    """

    goal_len = 6
    extra_len = 9
    mirror = {"goal": "XYZXYZ", "extra": "XYZxyzxyz", "axes": "xy"}
    extension = {
        "xml": """
            <worldbody>
              <body name="object1" pos="1.4 0.9 0.425">
                <joint type="free" damping="0.01"/>
                <geom type="box" size="0.025 0.025 0.025" mass="2" rgba="0.75 0.3 0.2 1"/>
              </body>
            </worldbody>"""
    }

    def begin_episode(self, sim, rng):
        """Place the second block beside the first one, and draw where they shall stand."""
        first, center = sim.position("object0"), sim.gripper()[:2]
        second = first
        while np.linalg.norm(second - first) < 2 * EDGE:
            second = np.append(center + rng.uniform(-0.15, 0.15, 2), first[2])
        sim.place("object1", second)
        lower = np.append(center + rng.uniform(-0.15, 0.15, 2), first[2])
        return np.concatenate([lower, lower + np.array([0, 0, EDGE])])

    def achieved_goal(self, sim):
        """Return where the blocks are."""
        return np.concatenate([sim.position(block) for block in BLOCKS], axis=-1)

    def observe_extra(self, sim):
        """Return the second block's position, also relative to the gripper, and its velocity."""
        block = sim.position("object1")
        relative = block - sim.gripper(), sim.velocity("object1") - sim.gripper_velocity()
        return np.concatenate([block, *relative], axis=-1)

    def compute_reward(self, achieved_goal, desired_goal, info):
        """Return -1 for each block that is not in its place."""
        return are_there(achieved_goal, desired_goal).sum(axis=-1) - 2.0

    def is_success(self, achieved_goal, desired_goal):
        """Tell whether both are."""
        return are_there(achieved_goal, desired_goal).all(axis=-1)


def collect(num_envs, steps):
    """Return a buffer of random episodes, and the mean reward of their steps."""
    envs = gymnasium.make_vec("fetch_env/FetchPickAndPlace-v4", num_envs, task=Stack())
    envs.action_space.seed(0)
    buffer = fetch_env.HerBuffer(envs, capacity=num_envs * steps, seed=0)
    envs.reset(seed=0)
    buffer.record(envs)
    rewards = []
    for _ in range(steps):
        rewards.append(envs.step(envs.action_space.sample())[1])
        buffer.record(envs)
    envs.close()
    return buffer, np.mean(rewards)


if __name__ == "__main__":
    buffer, mean = collect(num_envs=16, steps=200)
    batch = buffer.sample(4096, mirrored=0.5)
    print(f"mean reward {mean:.2f}, with the goals of hindsight {batch['reward'].mean():.2f}")
