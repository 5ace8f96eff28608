"""Trained policies."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from .spaces import parts

if TYPE_CHECKING:
    import os

    import torch
    from numpy.typing import NDArray

    from .spaces import Observation
    from .weights import Weights


class Policy:
    """A trained policy: a small network that returns the greedy action for an observation.

    ``policy(observation)`` returns an action of ``float32`` from -1 to 1, of shape (4,), or of
    shape (..., 4) for a batch of observations of any shape::

        policy = fetch_env.Policy.shipped("FetchPush-v4")
        action = policy(observation)

    One that sees pictures needs them in the observation, under the key ``pixels``, of ``uint8`` and
    of the shape (..., height, width, 3), as its own :attr:`view` shows them::

        pixels = env.unwrapped.draw(**policy.view)
        action = policy({**observation, "pixels": pixels})
    """

    def __init__(self, native: _native.Policy) -> None:
        """Wrap a policy that was loaded or trained."""
        self._native = native

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Policy:
        """Load a file that :meth:`save` or ``fetch-env train`` wrote.

        Raises:
            OSError: If the file cannot be read.
            ValueError: If it holds no policy.
        """
        return cls(_native.Policy.load(path))

    @classmethod
    def shipped(cls, env_id: str, *, robust: bool = False) -> Policy:
        """Return the policy that comes with the package for an environment's task.

        A robust one was trained in a world that varies: Push's with other masses, sizes and
        frictions, PickAndPlace's with noise. The other tasks have none.
        """
        return cls(_native.Policy.shipped(env_id, robust))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the policy to a safetensors file.

        A file that is there is replaced whole, or stays as it is.

        Raises:
            OSError: If the file cannot be written.
        """
        self._native.save(path)

    @property
    def header(self) -> dict[str, Any]:
        """How the policy was trained, and how often it succeeds if that was measured."""
        header: dict[str, Any] = json.loads(self._native.header())
        return header

    @property
    def view(self) -> dict[str, Any] | None:
        """The arguments with which ``draw()`` of an environment shows what the policy sees.

        They are ``None`` for a policy that sees the state.
        """
        view: dict[str, Any] | None = json.loads(self._native.view())
        return view

    def weights(self) -> Weights:
        """Return copies of all that an action is computed with, if it sees the state.

        It is the hyperbolic tangent of the last layer's outputs, and the layers before have
        rectified linear units::

            weights = policy.weights()
            goal = observation["desired_goal"]
            parts = {**observation, "relative_goal": goal - observation["achieved_goal"]}
            values = np.concatenate([parts[name] for name in weights["inputs"]], axis=-1)
            values = (values - weights["mean"]) / weights["std"]
            values = values.clip(-weights["clip"], weights["clip"])
            for weight, bias in weights["layers"]:
                outputs = values @ weight + bias
                values = np.maximum(outputs, 0)
            action = np.tanh(outputs)
        """
        header = self.header
        names = header["inputs"]
        mean, std, clip = np.concatenate([_scale(header, name) for name in names], axis=1)
        layers = self._native.layers()
        return {"inputs": names, "mean": mean, "std": std, "clip": clip, "layers": layers}

    def to_torch(self) -> torch.nn.Module:
        """Return a torch module of a copy of the weights.

        It takes an observation as the policy does, a dictionary of tensors of shape (..., length),
        and returns actions of ``float32``. They differ as sums in another order do: by at most 3e-5
        for the shipped policies, and 1e-6 for that of Reach. Its weights can be trained on.

        Raises:
            ModuleNotFoundError: If torch is not installed.
        """
        from .torch_policy import TorchPolicy  # noqa: PLC0415

        return TorchPolicy(self.weights())

    def to_onnx(self, path: str | os.PathLike[str]) -> None:
        """Write the policy as an ONNX model.

        It takes ``observation``, ``achieved_goal`` and ``desired_goal`` as environments return
        them, of ``float64``, each with rows of shape (N, length), and returns ``action`` of
        ``float32`` and shape (N, 4), which differs as little as that of :meth:`to_torch`::

            policy.to_onnx("push.onnx")
            session = onnxruntime.InferenceSession("push.onnx")
            (action,) = session.run(None, {key: part[None] for key, part in observation.items()})

        Raises:
            ModuleNotFoundError: If the package onnx is not installed.
            OSError: If the file cannot be written.
        """
        from .onnx_policy import write  # noqa: PLC0415

        header = self.header
        goal_len = header["goal_len"]
        lengths = {
            "observation": header["observation_len"],
            "achieved_goal": goal_len,
            "desired_goal": goal_len,
        }
        write(self.weights(), lengths, path)

    def __call__(self, observation: Observation) -> NDArray[np.float32]:
        """Return the greedy action; see the class.

        Raises:
            TypeError: If the observation is not a dictionary of ``observation``,
                ``achieved_goal`` and ``desired_goal``.
            ValueError: If their shapes do not fit the policy or each other, a number is NaN or
                infinite, or there are no pictures of the policy's size.
        """
        state, achieved_goal, desired_goal = parts(observation)
        return self._native.act(state, achieved_goal, desired_goal, observation.get("pixels"))

    def predict(
        self,
        observation: Observation,
        state: object = None,
        episode_start: object = None,
        deterministic: bool = True,  # noqa: FBT001, FBT002
    ) -> tuple[NDArray[np.float32], None]:
        """Return the greedy action as a policy of Stable-Baselines3 does."""
        del state, episode_start, deterministic
        return self(observation), None

    def __getstate__(self) -> bytes:
        """Return what pickling and copying keep: a file's contents."""
        return self._native.to_bytes()

    def __setstate__(self, state: bytes) -> None:
        """Load the policy."""
        self._native = _native.Policy(state)


def _scale(header: dict[str, Any], name: str) -> NDArray[np.float64]:
    """Return the means, the deviations and the bounds of a part of the input."""
    kind = "observation" if name == "observation" else "goal"
    mean, std, clip = np.zeros(header[f"{kind}_len"]), 1.0, np.inf
    if (scale := header[f"{kind}_normalizer"]) is not None:
        mean, clip = np.array(scale["mean"]), scale["clip"]
        if scale["count"]:
            std = np.sqrt(np.array(scale["squares"]) / scale["count"]).clip(min=scale["min_std"])
    return np.stack([mean, np.broadcast_to(std, mean.shape), np.full(mean.shape, clip)])
