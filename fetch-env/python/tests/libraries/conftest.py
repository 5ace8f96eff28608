"""Leaves out the files whose library is not installed."""

from importlib.util import find_spec

MODULES = {"rllib": "ray", "skrl": "skrl", "tianshou": "tianshou", "torchrl": "torchrl"}

collect_ignore = [
    f"test_{name}.py" for name, module in MODULES.items() if find_spec(module) is None
]
