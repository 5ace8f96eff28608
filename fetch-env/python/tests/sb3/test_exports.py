"""Policies outside the package: in torch and in ONNX."""

import sys

import fetch_env
import numpy as np
import pytest

torch = pytest.importorskip("torch")
onnxruntime = pytest.importorskip("onnxruntime")


def visited(env_id, policy):
    """Return what a policy sees in four episodes."""
    env, seen = fetch_env.FetchEnv(env_id), []
    for seed in range(4):
        observation, _ = env.reset(seed=seed)
        for _ in range(50):
            seen.append(observation)
            observation, *_ = env.step(policy(observation))
    return {key: np.stack([each[key] for each in seen]) for key in seen[0]}


# Sums of products of single precision, in another order, differ more after large ones.
@pytest.mark.parametrize(
    ("task", "tolerance"),
    [("Reach", 1e-6), ("Push", 2e-5), ("PickAndPlace", 5e-6), ("Slide", 1e-4)],
)
def test_exports_act_as_the_policy(tmp_path, task, tolerance):
    policy = fetch_env.Policy.shipped(f"Fetch{task}-v4")
    seen = visited(f"Fetch{task}-v4", policy)
    expected = policy(seen)
    assert 0.5 < np.abs(expected).max() <= 1.0
    module = policy.to_torch()
    with torch.no_grad():
        action = module({key: torch.from_numpy(part) for key, part in seen.items()})
    assert action.dtype == torch.float32
    np.testing.assert_allclose(action.numpy(), expected, rtol=0, atol=tolerance)
    policy.to_onnx(tmp_path / "policy.onnx")
    session = onnxruntime.InferenceSession(tmp_path / "policy.onnx")
    (action,) = session.run(None, seen)
    assert action.dtype == np.float32
    np.testing.assert_allclose(action, expected, rtol=0, atol=tolerance)


def test_a_module_is_saved_and_trained(tmp_path):
    policy = fetch_env.Policy.shipped("FetchPush-v4")
    seen = {key: torch.from_numpy(part) for key, part in visited("FetchPush-v4", policy).items()}
    module = policy.to_torch()
    torch.save(module.state_dict(), tmp_path / "policy.pt")
    before = module(seen)
    before.square().mean().backward()
    torch.optim.SGD(module.parameters(), 0.1).step()
    assert not torch.equal(module(seen), before)
    module.load_state_dict(torch.load(tmp_path / "policy.pt"))
    assert torch.equal(module(seen), before)


@pytest.mark.parametrize(("package", "export"), [("torch", "to_torch"), ("onnx", "to_onnx")])
def test_what_to_install_is_said(monkeypatch, tmp_path, package, export):
    monkeypatch.delitem(sys.modules, f"fetch_env.{package}_policy", raising=False)
    monkeypatch.setitem(sys.modules, package, None)
    policy = fetch_env.Policy.shipped("FetchReach-v4")
    arguments = [tmp_path / "policy.onnx"] if package == "onnx" else []
    with pytest.raises(ModuleNotFoundError, match=f"pip install {package}"):
        getattr(policy, export)(*arguments)
