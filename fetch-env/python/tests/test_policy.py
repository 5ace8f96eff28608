"""What trained policies act on."""

import textwrap

import fetch_env
import numpy as np
import pytest

PARTS = ("observation", "achieved_goal", "desired_goal")


@pytest.fixture
def policy():
    """Return the policy that comes with the package for Push."""
    return fetch_env.Policy.shipped("FetchPush-v4")


def observations(*batch):
    """Return observations of a batch shape."""
    env = fetch_env.FetchEnv("FetchPush-v4")
    count = int(np.prod(batch))
    seen = [env.reset(seed=seed)[0] for seed in range(count)]
    return {key: np.stack([each[key] for each in seen]).reshape(*batch, -1) for key in PARTS}


def test_actions_have_the_shape_of_the_batch(policy):
    seen = observations(2, 3)
    actions = policy(seen)
    assert actions.shape == (2, 3, 4)
    assert actions.dtype == np.float32
    for index in np.ndindex(2, 3):
        alone = policy({key: numbers[index] for key, numbers in seen.items()})
        assert alone.shape == (4,)
        np.testing.assert_array_equal(alone, actions[index])
    assert policy({key: numbers[:0] for key, numbers in seen.items()}).shape == (0, 3, 4)
    assert policy.predict(seen)[0].shape == (2, 3, 4)


@pytest.mark.parametrize("key", PARTS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_numbers_that_are_not_finite_are_named(policy, key, value):
    seen = observations(3)
    seen[key][1, 2] = value
    with pytest.raises(ValueError, match=rf"{key}\[2\] of row 1 is (NaN|-?inf|1e300): pass"):
        policy(seen)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"desired_goal": np.zeros(3)}, r"desired_goal has the shape \[3\]: pass \[2, 3\]"),
        ({"desired_goal": np.zeros((3, 2))}, r"desired_goal has the shape \[3, 2\]"),
        ({"achieved_goal": np.zeros((1, 2, 3))}, r"achieved_goal has the shape \[1, 2, 3\]"),
        (
            {"observation": np.zeros((2, 10))},
            r"observation has the shape \[2, 10\]: pass \[2, 25\]",
        ),
        ({"observation": np.zeros(())}, r"observation has the shape \[\]: pass \[25\]"),
        ({"observation": np.zeros((25, 2))}, r"observation has the shape"),
        ({"observation": [["up"] * 25] * 2}, "observation: pass an array of real numbers"),
        ({"achieved_goal": [[1.0, 2.0], [3.0]]}, "achieved_goal: "),
    ],
)
def test_shapes_that_do_not_fit_are_named(policy, change, message):
    with pytest.raises((TypeError, ValueError), match=message):
        policy({**observations(2), **change})


@pytest.mark.parametrize("observation", [np.zeros(25), None, {"observation": np.zeros(25)}])
def test_an_observation_is_a_dictionary_of_three_parts(policy, observation):
    with pytest.raises(TypeError, match="observation, achieved_goal and desired_goal"):
        policy(observation)


@pytest.mark.parametrize(("task", "tolerance"), [("Reach", 1e-6), ("Push", 2e-5), ("Slide", 1e-4)])
def test_weights_are_all_that_an_action_is_computed_with(task, tolerance):
    policy = fetch_env.Policy.shipped(f"Fetch{task}-v4")
    env = fetch_env.FetchEnv(f"Fetch{task}-v4")
    observation, _ = env.reset(seed=0)
    code = fetch_env.Policy.weights.__doc__.split("::\n")[1]
    for _ in range(50):
        names = {"policy": policy, "observation": observation, "np": np}
        exec(textwrap.dedent(code), names)  # noqa: S102
        action = policy(observation)
        np.testing.assert_allclose(names["action"], action, rtol=0, atol=tolerance)
        observation, *_ = env.step(action)


def test_robust_policies_come_with_two_tasks():
    """They differ from the others, and the other tasks have none."""
    robust = fetch_env.Policy.shipped("FetchPush-v4", robust=True)
    assert robust.header != fetch_env.Policy.shipped("FetchPush-v4").header
    with pytest.raises(ValueError, match="choose Push or PickAndPlace"):
        fetch_env.Policy.shipped("FetchReach-v4", robust=True)
