"""RLlib trains on the environments."""

import fetch_env  # noqa: F401 (registers the environments)
import gymnasium
import ray
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.connectors.env_to_module import FlattenObservations
from ray.tune.registry import register_env


def test_ppo_takes_an_iteration():
    """It samples whole episodes of dense Reach, and updates on them."""
    register_env("reach", lambda _: gymnasium.make("fetch_env/FetchReachDense-v4"))
    ray.init(num_cpus=1, include_dashboard=False)
    try:
        config = (
            PPOConfig()
            .environment("reach")
            .env_runners(
                num_env_runners=0, env_to_module_connector=lambda *_, **__: FlattenObservations()
            )
        )
        config = config.training(train_batch_size_per_learner=200, minibatch_size=50, num_epochs=1)
        algorithm = config.build_algo()
        result = algorithm.train()
        algorithm.stop()
    finally:
        ray.shutdown()
    assert result["env_runners"]["episode_len_mean"] == 50
    assert -30 < result["env_runners"]["episode_return_mean"] < 0
