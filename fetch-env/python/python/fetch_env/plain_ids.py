"""Importing this module calls :func:`fetch_env.replace_gymnasium_robotics`.

It is for programs that import a module which they are told: ``rl_zoo3.train --gym-packages
fetch_env.plain_ids``, or ``gymnasium.make("fetch_env.plain_ids:FetchPush-v4")``.
"""

from . import replace_gymnasium_robotics

replace_gymnasium_robotics()
