"""The settings of a draw in a model of Stable-Baselines3."""

import numpy as np
import pytest

stable_baselines3 = pytest.importorskip("stable_baselines3")

from fetch_env import sb3  # noqa: E402
from stable_baselines3 import SAC  # noqa: E402

GAMMA = 0.9


def model(env, **settings):
    return SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=sb3.HerReplayBuffer,
        replay_buffer_kwargs=settings,
        learning_starts=200,
        policy_kwargs={"net_arch": [32, 32]},
        device="cpu",
        seed=0,
    )


def draw(learner, count=512):
    np.random.seed(3)  # noqa: NPY002
    return learner.replay_buffer.sample(count)


def test_rewards_of_several_steps_come_with_their_discounts(tmp_path):
    env = sb3.FetchVecEnv("FetchReach-v4", 2)
    learner = model(env, n_step={"steps": 3, "gamma": GAMMA})
    learner.learn(300)
    batch = draw(learner)
    assert batch.discounts.shape == batch.rewards.shape == (512, 1)
    allowed = np.float32([GAMMA, GAMMA**2, GAMMA**3])
    assert {*batch.discounts.numpy().ravel()} == {*allowed}
    # The sums of one to three rewards of -1 and 0.
    sums = {a + GAMMA * b + GAMMA**2 * c for a in (0, -1) for b in (0, -1) for c in (0, -1)}
    far = np.abs(batch.rewards.numpy() - np.array(sorted(sums)))
    assert far.min(axis=1).max() < 1e-6
    learner.save_replay_buffer(tmp_path / "buffer.pkl")
    learner.load_replay_buffer(tmp_path / "buffer.pkl")
    again = draw(learner)
    assert (again.rewards == batch.rewards).all()
    assert (again.discounts == batch.discounts).all()


def test_settings_change_the_draw():
    env = sb3.FetchVecEnv("FetchReach-v4", 2)
    learner = model(env, goals=[{"strategy": "final", "weight": 1.0}], mirrored=1.0)
    learner.learn(200)
    plain = model(env, goal_selection_strategy="final")
    plain.learn(200)
    plain.replay_buffer._native = learner.replay_buffer._native  # noqa: SLF001
    ours, theirs = draw(learner), draw(plain)
    assert (ours.rewards == theirs.rewards).all()
    np.testing.assert_array_equal(ours.actions[:, 1], -theirs.actions[:, 1])
    np.testing.assert_array_equal(ours.actions[:, [0, 2, 3]], theirs.actions[:, [0, 2, 3]])
    assert ours.discounts is None


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"priorities": 0.4}, "no place for priorities"),
        ({"joined_goal": "desired"}, "no place for joined_goal"),
        ({"ratio": 0.5}, "no place for ratio: pass n_sampled_goal"),
        ({"nstep": None}, "there is no nstep; did you mean n_step"),
        ({"n_step": {"steps": 3}}, "n_step: pass gamma, too"),
    ],
)
def test_wrong_settings_are_refused_before_learning(settings, message):
    with pytest.raises(ValueError, match=message):
        model(sb3.FetchVecEnv("FetchReach-v4", 2), **settings)
