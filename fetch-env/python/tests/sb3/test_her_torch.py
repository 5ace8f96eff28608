"""The example that learns in torch."""

import runpy
from pathlib import Path

import fetch_env
import pytest

pytest.importorskip("torch")

EXAMPLE = Path(__file__).parents[2] / "examples" / "her_torch.py"


def test_it_learns_to_reach():
    """Hindsight and DDPG reach most goals after 12,000 steps."""
    agent = runpy.run_path(str(EXAMPLE))["learn"]()
    result = fetch_env.evaluate("FetchReach-v4", agent.act, batched=True)
    assert result["success_rate"]["value"] >= 0.9
