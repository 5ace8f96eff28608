"""The examples, shortened."""

import runpy
from pathlib import Path

EXAMPLES = Path(__file__).parents[1] / "examples"


def example(name):
    """Return what an example defines."""
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_the_quick_start_learns_to_reach():
    """Random actions do not push the block to its goal; the policy reaches its goals."""
    defined = example("quick_start")
    rewards, last = defined["random_episode"]()
    assert sum(rewards) == -50
    assert rewards[-1] == last
    training, result = defined["learn"]()
    assert result["success_rate"]["value"] >= 0.95
    assert defined["act"](training.policy, 16).all()


def test_a_policy_is_learned_from_a_data_set(tmp_path):
    """A linear policy imitates the noisy expert."""
    defined = example("data_sets")
    data = defined["write"](tmp_path, episodes=20)
    policy = defined["clone"](data)
    result = defined["fetch_env"].evaluate("FetchReach-v4", policy, 20, batched=True)
    assert result["success_rate"]["value"] >= 0.95


def test_the_robust_policy_pushes_on_slippery_ground():
    """It has as many successes there as on the usual ground, and the plain one fewer."""
    rates = example("robustness")["curves"](20, {"friction": [0.5, 1.0]})
    plain, robust = rates["friction"]
    assert plain[0] < plain[1]
    assert min(robust) >= 0.95
