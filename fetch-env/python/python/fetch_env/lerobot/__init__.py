"""For LeRobot: data sets that it writes itself, and an environment for its evaluation.

.. code-block:: python

    from fetch_env import lerobot

    lerobot.record("FetchPush-v4", "expert", "me/fetch-push", episodes=100, pixels=True)

.. code-block:: sh

    lerobot-train --dataset.repo_id=me/fetch-push --policy.type=act --policy.push_to_hub=false
    lerobot-eval --policy.path=outputs/train/.../pretrained_model \
        --env.discover_packages_path=fetch_env.lerobot --env.type=fetch --env.task=FetchPush-v4

Both have LeRobot's names of what a policy sees:

- ``observation.state``: the robot's 10 numbers, as in the observations of Reach.
- ``observation.environment_state``, without pictures: the object's 15 numbers, if there is one,
  and the desired goal (x, y, z in meters).
- ``observation.image``, with pictures: the scene from the front, with the goal as a red dot.
"""

try:
    from .env import FetchEnvConfig, LeRobotFetchEnv
    from .recording import record
except ModuleNotFoundError as error:
    _MESSAGE = f"{error}: fetch_env.lerobot needs LeRobot, pip install 'fetch-env[lerobot]'"
    raise ImportError(_MESSAGE) from error

__all__ = ["FetchEnvConfig", "LeRobotFetchEnv", "record"]
