"""The settings of a draw, against what numpy computes from the stored episodes."""

import os
import subprocess
import sys

import fetch_env
import numpy as np
import pytest
from buffers import Stored, flat, same

ROWS = 4000
GAMMA = 0.9


@pytest.fixture(scope="module")
def stored():
    return Stored()


def share(flags, expected):
    """Assert that a share of independent rows is what it should be, within five deviations."""
    deviation = np.sqrt(max(expected * (1.0 - expected), 1e-9) / len(flags))
    assert abs(np.mean(flags) - expected) < 5.0 * deviation


@pytest.mark.parametrize(
    "strategy",
    ["future", "final", "episode", "random", "past_desired", {"geometric": {"gamma": 0.5}}],
)
def test_new_goals_are_those_of_the_strategy(stored, strategy):
    batch = stored.buffer().sample(ROWS, strategy=strategy, seed=1)
    new, at, source = batch["relabeled"], batch["transition"] - 1, batch["goal_source"] - 1
    share(new, 0.8)
    np.testing.assert_array_equal(new, source >= 0)
    at, source = at[new], source[new]
    goals = stored.next_achieved_goal if strategy != "past_desired" else stored.desired_goal
    np.testing.assert_array_equal(batch["desired_goal"][new], goals[source])
    ahead = source - at
    if strategy not in ("random", "past_desired"):
        np.testing.assert_array_equal(stored.episode[at], stored.episode[source])
    if strategy == "future":
        assert ahead.min() == 0
    elif strategy == "final":
        assert stored.is_last[source].all()
    elif isinstance(strategy, dict):
        weights = [0.5**steps * (stored.left[at] > steps) for steps in range(stored.left.max())]
        share(ahead == 0, np.mean(1.0 / np.sum(weights, axis=0)))
    else:
        assert ahead.min() < 0 < ahead.max()
    reward = stored.compute_reward(batch["next_achieved_goal"], batch["desired_goal"])
    np.testing.assert_array_equal(batch["reward"][new], reward[new])
    np.testing.assert_array_equal(
        batch["reward"][~new], stored.reward[batch["transition"] - 1][~new]
    )


def test_a_mixture_has_its_shares(stored):
    parts = [("final", 3.0), ("past_desired", 1.0), ("random", 0.0)]
    goals = [{"strategy": strategy, "weight": weight} for strategy, weight in parts]
    batch = stored.buffer().sample(ROWS, goals=goals, ratio=0.6, seed=2)
    new, source = batch["relabeled"], batch["goal_source"] - 1
    share(new, 0.6)
    is_final = (batch["desired_goal"] == stored.next_achieved_goal[source]).all(axis=1)[new]
    share(is_final, 0.75)
    assert stored.is_last[source[new][is_final]].all()


@pytest.mark.parametrize("steps", [1, 3, 100])
@pytest.mark.parametrize("own", [None, flat])
def test_the_reward_of_several_steps_is_their_discounted_sum(stored, steps, own):
    buffer = stored.buffer(reward=own)
    batch = buffer.sample(500, n_step={"steps": steps, "gamma": GAMMA}, seed=3)
    for row in range(500):
        first, goal = batch["transition"][row] - 1, batch["desired_goal"][row]
        window = slice(first, first + min(steps, stored.left[first]))
        rewards = stored.reward[window]
        if batch["relabeled"][row]:
            achieved = stored.next_achieved_goal[window]
            goals = np.broadcast_to(goal, achieved.shape)
            rewards = (
                own(achieved, goals, [{}] * len(goals))
                if own
                else stored.compute_reward(achieved, goals)
            )
        used = len(rewards)
        assert batch["reward"][row] == pytest.approx(GAMMA ** np.arange(used) @ rewards, rel=1e-5)
        last = window.stop - 1
        np.testing.assert_array_equal(batch["next_observation"][row], stored.next_observation[last])
        np.testing.assert_array_equal(batch["observation"][row], stored.observation[first])
        assert batch["terminated"][row] == stored.terminated[last]
        expected = 0.0 if stored.terminated[last] else GAMMA**used
        assert batch["discount"][row] == pytest.approx(expected)


@pytest.mark.parametrize("unit", ["transition", "episode"])
def test_priorities_shift_the_shares(stored, unit):
    buffer = stored.buffer(priorities={"unit": unit})
    count = len(buffer)
    units = np.arange(count) if unit == "transition" else stored.episode
    priorities = np.random.default_rng(0).uniform(0.5, 4.0, count)
    priorities[units == 1] = 0.0
    if unit == "episode":
        priorities = priorities[np.searchsorted(stored.episode, stored.episode)]
    buffer.set_priorities(np.arange(count) + 1, priorities)
    assert buffer.priority(3) == priorities[2]
    assert buffer.priority(10**6) is None
    chances = priorities / priorities.sum()
    if unit == "episode":
        lengths = np.bincount(stored.episode)[stored.episode]
        chances = (priorities / lengths) / (priorities / lengths).sum()
    batch = buffer.sample(ROWS, priorities=0.4, seed=4)
    at = batch["transition"] - 1
    for transition in range(count):
        share(at == transition, chances[transition])
    weights = (count * chances[at]) ** -0.4
    np.testing.assert_allclose(batch["importance_weight"], weights / weights.max(), rtol=1e-5)
    assert "importance_weight" not in buffer.sample(8)


def test_new_transitions_have_the_priority_of_the_setting(stored):
    buffer = stored.buffer(priorities={"unit": "transition", "new_priority": {"given": 2.5}})
    assert buffer.priority(1) == 2.5
    assert stored.buffer(priorities={"unit": "transition"}).priority(1) == 1.0


@pytest.mark.parametrize(("env_id", "turns"), [("FetchReach-v4", 1), ("FetchPush-v4", 3)])
def test_mirrored_rows_are_mirror_images(env_id, turns):
    env = fetch_env.FetchEnv(env_id)
    stored, start = Stored(env), np.asarray(env.initial_gripper_xpos)
    buffer = stored.buffer()
    for seed in range(6):
        # Left and right, front and back, or both.
        axes = ([1], [0], [0, 1])[seed % turns]
        plain = buffer.sample(600, seed=seed)
        mirrored = buffer.sample(600, seed=seed, mirrored=0.5)
        is_image = (plain["action"] != mirrored["action"]).any(axis=1)
        share(is_image, 0.5)
        for key in ("achieved_goal", "desired_goal", "next_achieved_goal", "observation"):
            expected = plain[key].astype(np.float64)
            expected[np.ix_(is_image, axes)] *= -1.0
            expected[np.ix_(is_image, axes)] += 2.0 * start[axes]
            np.testing.assert_allclose(mirrored[key][:, :3], expected[:, :3], atol=1e-6)
        expected = plain["action"].copy()
        expected[np.ix_(is_image, axes)] *= -1.0
        np.testing.assert_array_equal(mirrored["action"], expected)
        changed = {key for key in plain if "goal" in key or "observation" in key} | {"action"}
        same(plain, mirrored, but=changed - {"goal_source"})


def test_noise_moves_a_share_of_the_new_goals(stored):
    buffer = stored.buffer()
    plain = buffer.sample(ROWS, seed=6)
    moved = buffer.sample(ROWS, seed=6, goal_noise={"radius": 0.04, "share": 0.5})
    far = np.linalg.norm(moved["desired_goal"] - plain["desired_goal"], axis=1)
    assert far.max() <= 0.04 + 1e-6
    share(far[plain["relabeled"]] > 0.0, 0.5)
    # Uniform in a ball: an eighth is within half of the radius.
    share(far[far > 0.0] < 0.02, 0.125)
    assert not far[~plain["relabeled"]].any()
    new = moved["relabeled"]
    reward = stored.compute_reward(moved["next_achieved_goal"], moved["desired_goal"])
    np.testing.assert_array_equal(moved["reward"][new], reward[new])
    same(plain, moved, but={"desired_goal", "reward"})


@pytest.mark.parametrize("kind", ["desired", "relative"])
def test_joined_goals_follow_the_observations(stored, kind):
    buffer = stored.buffer()
    plain, joined = buffer.sample(64, seed=7), buffer.sample(64, seed=7, joined_goal=kind)
    for prefix in ("", "next_"):
        goal = plain["desired_goal"].astype(np.float64)
        if kind == "relative":
            goal -= plain[f"{prefix}achieved_goal"]
        expected = np.hstack([plain[f"{prefix}observation"], goal.astype(np.float32)])
        np.testing.assert_array_equal(joined[f"{prefix}input"], expected)
        assert f"{prefix}observation" not in joined


def test_fields_are_those_of_the_transition(stored):
    fields = {"log_prob": 1, "hidden": 3}
    buffer = stored.buffer(fields=fields)
    for settings in ({}, {"n_step": {"steps": 4, "gamma": GAMMA}}):
        batch = buffer.sample(64, seed=8, **settings)
        at = batch["transition"] - 1
        for name, length in fields.items():
            expected = stored.field(length)[at]
            np.testing.assert_array_equal(batch[f"fields_{name}"], expected)
            assert expected.shape == (64, length)


def test_fields_are_recorded_with_each_step(actions):
    envs = fetch_env.FetchVectorEnv("FetchReach-v4", 2)
    buffer = fetch_env.HerBuffer(envs, 1000, fields={"value": 1, "pair": 2})
    envs.reset(seed=0)
    buffer.record(envs)
    for step in range(50):
        envs.step(actions[step : step + 2])
        value = np.array([step, step + 0.5])
        buffer.record(envs, fields={"value": value, "pair": np.stack([value, -value], axis=1)})
    batch = buffer.sample(256, seed=0)
    at = batch["transition"] - 1
    value = (at % 50 + 0.5 * (at // 50))[:, None]
    np.testing.assert_array_equal(batch["fields_value"], value)
    np.testing.assert_array_equal(batch["fields_pair"], np.hstack([value, -value]))
    envs.step(actions[:2])
    buffer.record(envs)
    envs.step(actions[:2])
    for fields, message in (
        (None, "field `value` is missing"),
        ({"value": value[:2]}, "field `pair` is missing"),
        ({"value": value[:2], "pair": value[:2]}, r"pair has the shape \(2, 1\): pass \(2, 2\)"),
        ({"valu": value[:2]}, r"no field .valu. among \[value, pair\]: .*fields="),
    ):
        with pytest.raises(ValueError, match=message):
            buffer.record(envs, fields=fields)


def test_terminations_of_new_goals_are_those_of_a_function(stored):
    def ends(achieved_goal, desired_goal, info):
        assert len(info) == len(achieved_goal)
        return np.linalg.norm(achieved_goal - desired_goal, axis=-1) < 0.03

    buffer = stored.buffer(terminated=ends)
    plain = buffer.sample(ROWS, seed=9)
    at, new = plain["transition"] - 1, plain["relabeled"]
    np.testing.assert_array_equal(plain["terminated"], stored.terminated[at])
    recomputed = ends(plain["next_achieved_goal"], plain["desired_goal"], range(ROWS))
    assert 0 < recomputed[new].sum() < new.sum()
    for termination, expected in (
        ("stored", plain["terminated"]),
        ("recomputed", np.where(new, recomputed, plain["terminated"])),
        ("stored_or_recomputed", plain["terminated"] | (new & recomputed)),
    ):
        batch = buffer.sample(ROWS, seed=9, termination=termination)
        np.testing.assert_array_equal(batch["terminated"], expected)
        same(plain, batch, but={"terminated"})
    never = stored.buffer().sample(ROWS, seed=9, termination="recomputed")
    assert not never["terminated"][new].any()


def test_rewards_are_recomputed_in_all_rows(stored):
    batch = stored.buffer(reward=flat).sample(ROWS, seed=10, recomputed_rewards=True)
    goals = batch["next_achieved_goal"], batch["desired_goal"]
    np.testing.assert_array_equal(batch["reward"], flat(*goals, range(ROWS)))
    assert not batch["relabeled"].all()


def test_rows_whose_goal_was_achieved_are_drawn_again(stored):
    buffer = stored.buffer()

    def achieved(**settings):
        batch = buffer.sample(20 * ROWS, success=True, **settings)
        is_success = stored.compute_reward(batch["next_achieved_goal"], batch["desired_goal"]) == 0
        np.testing.assert_array_equal(batch["success"], is_success)
        return stored.compute_reward(batch["achieved_goal"], batch["desired_goal"]) == 0

    before = np.mean(achieved(seed=11))
    share(achieved(seed=12, keep_already_achieved=0.0), before**4)
    assert 0.1 < before < 0.9


DRAW_ON_THREADS = """
import hashlib
from buffers import Stored
batch = Stored().buffer().sample(5000, seed=13, parallel=True, n_step={"steps": 2, "gamma": 0.5})
print(hashlib.sha256(b"".join(each.tobytes() for each in batch.values())).hexdigest())
"""


def test_the_same_seed_draws_the_same_rows_on_any_number_of_threads(stored):
    buffer = stored.buffer()
    settings = {"seed": 13, "n_step": {"steps": 2, "gamma": 0.5}}
    same(buffer.sample(5000, **settings), buffer.sample(5000, parallel=True, **settings))
    hashes = set()
    for threads in (1, 3):
        environment = {**os.environ, "RAYON_NUM_THREADS": str(threads)}
        environment["PYTHONPATH"] = os.pathsep.join(sys.path)
        drawn = subprocess.run(  # noqa: S603
            [sys.executable, "-c", DRAW_ON_THREADS],
            check=True,
            capture_output=True,
            text=True,
            env=environment,
        )
        hashes.add(drawn.stdout)
    assert len(hashes) == 1
