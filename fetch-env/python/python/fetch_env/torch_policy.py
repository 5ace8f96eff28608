"""Policies as torch modules."""

from __future__ import annotations

from typing import TYPE_CHECKING

try:
    import torch
except ModuleNotFoundError as error:
    MESSAGE = "torch is not installed, which to_torch() needs: pip install torch"
    raise ModuleNotFoundError(MESSAGE, name="torch") from error

if TYPE_CHECKING:
    from .weights import Weights


class TorchPolicy(torch.nn.Module):
    """The network of a policy; see :meth:`fetch_env.Policy.to_torch`."""

    mean: torch.Tensor
    std: torch.Tensor
    clip: torch.Tensor

    def __init__(self, weights: Weights) -> None:
        """Copy the weights."""
        super().__init__()
        self.inputs = weights["inputs"]
        for name in ("mean", "std", "clip"):
            self.register_buffer(name, torch.from_numpy(weights[name]))
        modules: list[torch.nn.Module] = []
        for weight, bias in weights["layers"]:
            # The caller's random numbers stay.
            linear = torch.nn.utils.skip_init(torch.nn.Linear, *weight.shape)
            linear.weight = torch.nn.Parameter(torch.from_numpy(weight.T.copy()))
            linear.bias = torch.nn.Parameter(torch.from_numpy(bias))
            modules += [linear, torch.nn.ReLU()]
        self.layers = torch.nn.Sequential(*modules[:-1], torch.nn.Tanh())

    def forward(self, observation: dict[str, torch.Tensor]) -> torch.Tensor:
        """Return the actions of shape (..., 4)."""
        # Single precision has no digits to spare for positions.
        parts = {name: part.double() for name, part in observation.items()}
        parts["relative_goal"] = parts["desired_goal"] - parts["achieved_goal"]
        values = torch.cat([parts[name] for name in self.inputs], dim=-1)
        values = ((values - self.mean) / self.std).clamp(-self.clip, self.clip)
        return self.layers(values.float())
