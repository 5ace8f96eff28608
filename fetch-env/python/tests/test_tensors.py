"""Arrays of other packages, on their way in and out."""

import fetch_env
import numpy as np
import pytest
from buffers import Stored


class Tensor:
    """An array that knows no other protocol than DLPack."""

    def __init__(self, numbers):
        self._numbers = numbers

    def __dlpack__(self, **arguments):
        return self._numbers.__dlpack__(**arguments)

    def __dlpack_device__(self):
        return self._numbers.__dlpack_device__()


def test_a_tensor_is_an_action(actions):
    for numbers in (actions, actions.astype(np.float64)):
        one, other = (fetch_env.FetchEnv("FetchPush-v4") for _ in range(2))
        for env in (one, other):
            env.reset(seed=0)
        steps = one.step(Tensor(numbers[0])), other.step(numbers[0])
        np.testing.assert_array_equal(*(step[0]["observation"] for step in steps))
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2)
    envs.reset(seed=0)
    observations = envs.step(Tensor(actions[:2]))[0]
    rewards = envs.compute_reward(
        Tensor(observations["achieved_goal"]), Tensor(observations["desired_goal"])
    )
    assert rewards.shape == (2,)
    with pytest.raises(ValueError, match="shape"):
        envs.step(Tensor(actions[:3]))


def test_torch_shares_what_is_returned(push, actions):
    torch = pytest.importorskip("torch")
    observation = push.step(torch.from_numpy(actions[0]))[0]
    for numbers in (*observation.values(), *Stored(push).buffer().sample(4).values()):
        tensor = torch.from_dlpack(numbers)
        assert tensor.data_ptr() == numbers.ctypes.data
        assert tensor.shape == numbers.shape
    push.goal = torch.zeros(3)
    assert push.goal.tolist() == [0.0] * 3
