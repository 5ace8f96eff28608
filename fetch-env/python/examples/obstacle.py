"""Push the block around a wall: a task with its own reward, which the learner in Rust trains."""

import fetch_env
import numpy as np

#: The contact is hard: MuJoCo's default lets the block, which is pushed with force, sink in.
WALL = """
    <worldbody>
      <body name="wall" mocap="true" pos="1.3 0.75 0.42">
        <geom type="box" size="0.015 0.06 0.02" rgba="0.2 0.35 0.75 1"
              priority="1" solref="0.004 1" solimp="0.99 0.99 0.001"/>
      </body>
    </worldbody>"""


class Obstacle:
    """Push the block to a place behind a wall.

    A goal has 5 elements, in meters: the block's position, and x and y of the wall, which are the
    same in the achieved and in the desired goal.
    """

    goal_len = 5
    extra_len = 4
    extension = {"xml": WALL}

    def begin_episode(self, sim, rng):
        """Draw the block's place, and put the wall on the way to it."""
        block, center = sim.position("object0"), sim.gripper()[:2]
        goal = block
        while np.linalg.norm(goal - block) < 0.15:
            goal = np.append(center + rng.uniform(-0.15, 0.15, 2), block[2])
        wall, (x, y, _) = (block + goal) / 2, (goal - block) / np.linalg.norm(goal - block)
        sim.place("wall", wall, [[x, -y, 0], [y, x, 0], [0, 0, 1]])
        return np.concatenate([goal, wall[:2]])

    def achieved_goal(self, sim):
        """Return where the block and the wall are."""
        return np.concatenate([sim.position("object0"), sim.position("wall")[:, :2]], axis=-1)

    def observe_extra(self, sim):
        """Return the way from the block to the wall, and the wall's direction."""
        way = sim.position("wall") - sim.position("object0")
        return np.concatenate([way[:, :2], sim.rotation("wall")[:, :2, 0]], axis=-1)

    def compute_reward(self, achieved_goal, desired_goal, info):
        """Return -1 until the block is in its place, and another -1 near the wall."""
        near = np.linalg.norm(achieved_goal[:, :2] - achieved_goal[:, 3:], axis=-1) < 0.08
        return -1.0 * ~self.is_success(achieved_goal, desired_goal) - near

    def is_success(self, achieved_goal, desired_goal):
        """Tell whether the block is within 5 cm of its place."""
        return np.linalg.norm(achieved_goal[:, :3] - desired_goal[:, :3], axis=-1) < 0.05


def learn(steps):
    """Train, and return the policy's success rate."""
    training = fetch_env.train("FetchPush-v4", steps=steps, task=Obstacle(), progress=False)
    result = fetch_env.evaluate("FetchPush-v4", training.policy, 50, task=Obstacle())
    return result["success_rate"]["value"]


if __name__ == "__main__":
    print(f"success rate {learn(steps=200_000):.2f}")
