"""Starts the real Fetch environments, even on versions of MuJoCo on which they fail to start.

From MuJoCo 3.12 on, gymnasium-robotics 1.4.2 cannot make any Fetch environment: it asserts that the
type of a joint, a numpy integer, is in a tuple of MuJoCo's enumeration, and these no longer compare
equal in that order. With int() around the joint's type it starts, and nothing else changes.
"""

import inspect

import gymnasium
import gymnasium_robotics
from gymnasium_robotics.utils import mujoco_utils

gymnasium.register_envs(gymnasium_robotics)


def starts():
    try:
        gymnasium.make("FetchReach-v4").close()
    except AssertionError:
        return False
    return True


def convert_joint_types():
    for name in ("set_joint_qpos", "set_joint_qvel", "get_joint_qpos", "get_joint_qvel"):
        source = inspect.getsource(getattr(mujoco_utils, name))
        changed = source.replace("model.jnt_type[joint_id]", "int(model.jnt_type[joint_id])")
        assert changed != source
        exec(changed, vars(mujoco_utils))


# Whether the environments start only with this workaround.
WORKAROUND = not starts()
if WORKAROUND:
    convert_joint_types()
    assert starts()
