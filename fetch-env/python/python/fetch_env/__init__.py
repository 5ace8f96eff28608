"""The Fetch robotics benchmark for Gymnasium, written in Rust on MuJoCo.

The eight environments ``FetchReach``, ``FetchPush``, ``FetchPickAndPlace`` and ``FetchSlide``, with
sparse and ``Dense`` rewards, give the same bits as gymnasium-robotics 1.4.2 for the same seeds and
actions::

    import fetch_env
    import gymnasium

    env = gymnasium.make("fetch_env/FetchPush-v4")
    observation, info = env.reset(seed=42)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

``gymnasium.make_vec("fetch_env/FetchPush-v4", num_envs=16)`` steps many on all cores.
"""

from importlib.metadata import version
from pathlib import Path

from . import _native
from ._native import MujocoError, MujocoWarning, Sim, SimulationError
from .datasets import write_dataset
from .env import FetchEnv
from .her import HerBuffer
from .ids import ENV_IDS, register_own, replace_gymnasium_robotics
from .learn import CurveRow, Training, evaluate, robustness, train
from .model import download_reference_model, has_reference_model, library_path
from .pictures import Pixels
from .policy import Policy
from .program import main
from .sampling import Mirror, Sampling
from .settings import Settings
from .task import Task
from .vector import FetchVectorEnv

__all__ = [
    "ENV_IDS",
    "CurveRow",
    "FetchEnv",
    "FetchVectorEnv",
    "HerBuffer",
    "Mirror",
    "MujocoError",
    "MujocoWarning",
    "Pixels",
    "Policy",
    "Sampling",
    "Settings",
    "Sim",
    "SimulationError",
    "Task",
    "Training",
    "download_reference_model",
    "evaluate",
    "has_reference_model",
    "library_path",
    "main",
    "replace_gymnasium_robotics",
    "robustness",
    "train",
    "write_dataset",
]

__version__ = version("fetch-env")

_mujoco = Path(__file__).parent / "_mujoco"
for _library in (*_mujoco.glob("libmujoco*"), *_mujoco.glob("*.dll")):
    _native.use_library(_library)

register_own()
