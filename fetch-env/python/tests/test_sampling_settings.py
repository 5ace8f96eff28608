"""The settings of a draw and of a buffer: their names, their errors, and functions beside them."""

import fetch_env
import numpy as np
import pytest
from buffers import Stored, flat, same

GAMMA = 0.9


@pytest.fixture(scope="module")
def stored():
    return Stored()


EVERY = {
    "goals": [{"strategy": "future", "weight": 1.0}, {"strategy": "random", "weight": 1.0}],
    "ratio": 0.5,
    "termination": "recomputed",
    "success": True,
    "n_step": {"steps": 3, "gamma": GAMMA},
    "priorities": 0.5,
    "parallel": True,
    "joined_goal": "relative",
    "keep_already_achieved": 0.5,
    "recomputed_rewards": True,
    "goal_noise": {"radius": 0.01, "share": 0.5},
}


@pytest.mark.parametrize("name", [*EVERY, None])
def test_a_function_goes_with_every_setting(stored, name):
    """One that computes the environment's rewards draws the environment's batches."""
    settings = EVERY if name is None else {name: EVERY[name]}
    priorities = {"unit": "transition"}

    def reward(achieved_goal, desired_goal, info):
        del info
        return stored.compute_reward(achieved_goal, desired_goal)

    ours, own = stored.buffer(priorities=priorities), stored.buffer(reward, priorities=priorities)
    same(ours.sample(300, seed=14, **settings), own.sample(300, seed=14, **settings))


def test_a_function_is_not_asked_of_mirror_images(stored):
    for functions in ({"reward": flat}, {"terminated": flat}):
        with pytest.raises(ValueError, match=r"^mirrored: a function of your own may judge"):
            stored.buffer(**functions).sample(8, mirrored=0.5)


def test_every_setting_has_its_place_in_the_types(stored):
    names = fetch_env.Sampling.__annotations__
    assert names.keys() == {*EVERY, "mirrored"}
    with pytest.raises(ValueError, match="there is no nstep; did you mean n_step") as raised:
        stored.buffer().sample(8, nstep=None)
    listed = str(raised.value).split("All are: ")[1].split(", ")
    assert {*listed} == {*names, "batch_size"}
    with pytest.raises(
        ValueError, match="strategy: there is no futur; did you mean future"
    ) as raised:
        stored.buffer().sample(8, strategy="futur")
    listed = str(raised.value).split("All are: ")[1].split(", ")
    hinted = fetch_env.sampling.GoalStrategy
    assert {*listed} == {each for each in listed if f"'{each}'" in hinted} | {"geometric"}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"n_step": {"steps": 0, "gamma": 0.9}},
            "n_step: pass an integer from 1 on, not integer `0`",
        ),
        ({"n_step": {"steps": 2, "gama": 0.9}}, "n_step: there is no gama; did you mean gamma"),
        ({"n_step": {"steps": 2}}, "n_step: pass gamma, too"),
        ({"n_step": 3}, "n_step: pass a dictionary, not integer `3`"),
        ({"mirrored": 1.5}, "mirrored: 1.5 is not a number from 0 to 1: pass one"),
        ({"ratio": "up"}, 'ratio: pass a number, not string "up"'),
        ({"ratio": np.nan}, "ratio is nan: pass finite numbers"),
        ({"success": 1}, "success: pass True or False, not integer `1`"),
        ({"goals": []}, "goals: a mixture cannot have 0 parts"),
        ({"goals": "future"}, "goals: pass a list, not string"),
        ({"strategy": 3}, "strategy: pass a name or a dictionary, not integer `3`"),
        ({"strategy": {"geometric": 3}}, "strategy: pass a dictionary, not integer `3`"),
        ({"strategy": "final", "goals": []}, "pass either strategy or goals"),
        ({"k": 1.0, "ratio": 0.5}, "pass either k or ratio"),
        ({"priorities": 0.4}, r"no priorities: make it with HerBuffer\(\.\.\., priorities="),
        ({"goal_noise": {"radius": -1, "share": 1}}, "the radius of the goal noise is -1"),
        (
            {"termination": "recompute"},
            "termination: there is no recompute; did you mean recomputed",
        ),
    ],
)
def test_a_wrong_setting_is_named(stored, settings, message):
    with pytest.raises(ValueError, match=message):
        stored.buffer().sample(8, **settings)


def test_numbers_of_numpy_are_settings(stored):
    buffer = stored.buffer()
    same(
        buffer.sample(8, seed=1, ratio=np.float32(0.5), n_step={"steps": np.int64(2), "gamma": 1}),
        buffer.sample(8, seed=1, ratio=0.5, n_step={"steps": 2, "gamma": 1.0}),
    )


def test_priorities_are_set_by_the_numbers_of_a_batch(stored):
    buffer = stored.buffer(priorities={"unit": "transition"})
    for transitions, priorities, message in (
        ([0], [1.0], "transitions has 0.0: pass the column transition"),
        ([1.5], [1.0], "transitions has 1.5: pass the column transition"),
        ([10**6], [1.0], "1000000 was never stored here"),
        ([[1]], [1.0], r"transitions has the shape \(1, 1\): pass \(N,\)"),
        ([1, 2], [1.0], "1 priorities were given for 2 transitions"),
        ([1], [-1.0], "priority 0 is -1"),
    ):
        with pytest.raises(ValueError, match=message):
            buffer.set_priorities(transitions, priorities)
    with pytest.raises(ValueError, match="no priorities: make it with HerBuffer"):
        stored.buffer().set_priorities([1], [1.0])
    buffer.set_priorities(np.arange(len(buffer)) + 1, np.zeros(len(buffer)))
    with pytest.raises(ValueError, match="all priorities are 0"):
        buffer.sample(8, priorities=0.4)
    assert buffer.transition_ids == (1, len(buffer))
    assert stored.buffer(fill=False).transition_ids is None


@pytest.mark.parametrize("kept", [0.0, 1.0])
def test_motionless_episodes_are_left_out(stored, kept):
    buffer = stored.buffer(motionless_episodes={"max_distance": 0.01, "kept": kept}, fill=False)
    still = {**stored.episodes[0], "achieved_goal": np.zeros((8, 3))}
    buffer.add_episode(**still)
    assert buffer.num_episodes == kept
    buffer.add_episode(**stored.episodes[0])
    assert buffer.num_episodes == kept + 1
