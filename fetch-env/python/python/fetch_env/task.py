"""Tasks that users write."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from ._native import Sim


class Task(Protocol):
    """A task of your own, which is the setting ``task`` of environments.

    Any object with these members is one. A task has no state of its own: one object serves all
    environments, and all that an episode changes is in the simulation and in the goal::

        class Lift:
            goal_len = 3

            def begin_episode(self, sim, rng):
                return sim.position("object0") + np.array([0, 0, rng.uniform(0.1, 0.3)])

            def achieved_goal(self, sim):
                return sim.position("object0")

        envs = gymnasium.make_vec("fetch_env/FetchPickAndPlace-v4", num_envs=16, task=Lift())

    The methods of a vector are called once for all environments, with arrays that have a leading
    axis of N; those of one environment with N = 1. With ``AutoresetMode.SAME_STEP``, noise or delay
    of observations, :func:`train` and :func:`evaluate` they are called for each environment, which
    takes longer. Exceptions reach the caller as they are.

    It may also have:

    - ``extra_len``: the number of elements that ``observe_extra(sim)`` adds to the observation: it
      returns (N, extra_len).
    - ``compute_reward(achieved_goal, desired_goal, info)``: rewards (N,) of goals (N, goal_len), by
      default those of the settings, from the distance of the goals; ``info`` is ``None``. Replay
      buffers relabel with it.
    - ``reward_range``: the smallest and the largest reward, with which learning is faster.
    - ``is_success(achieved_goal, desired_goal)``: booleans (N,), by default whether the goals are
      within the distance threshold.
    - ``extension``: what it changes in the built-in model, a dictionary of ``xml`` (sections of
      MJCF, such as ``<worldbody>``, with bodies that have free joints or are mocap bodies),
      ``object_shape`` (such as ``{"sphere": {"radius": 0.03}}``), ``object_mass`` (in kilograms)
      and ``object_friction``.
    - ``mirror``: how it looks in a mirror, with which learning is faster: a dictionary of ``goal``
      and ``extra``, with a letter for each element, and ``axes``, as in :class:`Mirror`. The
      mirrors pass through the gripper's start. Your starts, rewards and bodies must be
      symmetric, too.
    """

    goal_len: int
    """Number of elements of a goal."""

    def begin_episode(self, sim: Sim, rng: np.random.Generator) -> ArrayLike:
        """Place bodies, and draw the goal, of shape (goal_len,). Arrays have no leading axis."""

    def achieved_goal(self, sim: Sim) -> ArrayLike:
        """Return the goals that the states achieve, of shape (N, goal_len)."""
