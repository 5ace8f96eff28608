"""For Stable-Baselines3: many environments on Rust's threads, and a hindsight replay buffer.

.. code-block:: python

    from stable_baselines3 import SAC
    from fetch_env.sb3 import FetchVecEnv, HerReplayBuffer

    env = FetchVecEnv("FetchReach-v4", 4)
    model = SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=HerReplayBuffer,
        learning_starts=200,  # by then, the first episodes of the four have ended
    )
    model.learn(20_000)
"""

from .buffer import HerReplayBuffer
from .vec_env import FetchVecEnv

__all__ = ["FetchVecEnv", "HerReplayBuffer"]

# The names by which pickles and messages know them.
FetchVecEnv.__module__ = HerReplayBuffer.__module__ = __name__
