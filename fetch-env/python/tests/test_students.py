"""Students: trainings with a teacher, and policies that see pictures."""

import pickle

import fetch_env
import numpy as np
import pytest


@pytest.fixture(scope="module")
def run():
    """Return arguments of a training with few and small updates and evaluations."""
    arguments = {"env_id": "FetchReach-v4", "teacher": "trained", "progress": False}
    settings = fetch_env.train(**arguments, steps=0).settings
    settings.update(hidden=[16], num_envs=4, batch_size=8, updates_per_step=1)
    settings.update(evaluation_interval=200, evaluation_episodes=3)
    return {**arguments, "preset": settings, "target": None}


@pytest.fixture(scope="module")
def student(run):
    """Return a policy that sees pictures."""
    return fetch_env.train(**run, steps=400, pixels={"size": 24}).policy


def test_a_student_is_resumed_to_the_same_bits_with_the_same_picture_and_teacher(
    run, student, tmp_path
):
    pixels = {"size": 24}
    fetch_env.train(**run, steps=200, pixels=pixels, out=tmp_path)
    resumed = fetch_env.train(**run, steps=400, pixels=pixels, out=tmp_path, resume=True)
    assert resumed.policy.__getstate__() == student.__getstate__()
    assert [row["counters"]["steps"] for row in resumed.curve] == [200, 400]
    page = (tmp_path / "page.html").read_text()
    assert 'class="seen"' in page
    for changed, message in [
        ({"pixels": {"size": 32}}, "student that sees 24 x 24 pixels"),
        ({"pixels": {**pixels, "camera": "reference"}}, "student that sees 24 x 24 pixels"),
        ({"pixels": pixels, "teacher": "scripted"}, "another teacher"),
        ({"pixels": pixels, "teacher": None, "preset": "fast"}, "has a teacher"),
        ({"teacher": None, "preset": "fast"}, "the run has a teacher"),
    ]:
        with pytest.raises(ValueError, match=message):
            fetch_env.train(**{**run, **changed}, steps=600, out=tmp_path, resume=True)


def test_a_policy_learns_from_pictures_without_a_teacher_and_is_resumed(tmp_path):
    arguments = {"env_id": "FetchReachDense-v4", "progress": False, "target": None}
    pixels = {"size": 24}
    settings = fetch_env.train(**arguments, steps=0, pixels=pixels).settings
    settings["pixels"].update(pixel_hidden=[16], pixel_batch_size=4)
    settings["algorithm"]["ddpg"]["hidden"] = [16]
    settings["schedule"].update(updates_per_cycle=8, evaluation_episodes=3)
    arguments["preset"] = settings
    whole = fetch_env.train(**arguments, steps=600, pixels=pixels)
    assert whole.policy.view is not None
    assert whole.settings == settings
    fetch_env.train(**arguments, steps=300, pixels=pixels, out=tmp_path)
    resumed = fetch_env.train(**arguments, steps=600, pixels=pixels, out=tmp_path, resume=True)
    assert resumed.policy.__getstate__() == whole.policy.__getstate__()
    assert [row["success_rate"] for row in resumed.curve] == [
        row["success_rate"] for row in whole.curve
    ]
    assert 'class="seen"' in (tmp_path / "page.html").read_text()
    for changed, message in [
        ({"pixels": {"size": 32}}, "student that sees 24 x 24 pixels"),
        ({"pixels": {**pixels, "marker": True}}, "student that sees 24 x 24 pixels"),
        ({"preset": "fast"}, "sees 24 x 24 pixels"),
        ({"pixels": pixels, "teacher": "trained", "preset": "fast"}, "has no teacher"),
        ({"pixels": pixels, "preset": "fast"}, "has other settings"),
    ]:
        with pytest.raises(ValueError, match=message):
            fetch_env.train(**{**arguments, **changed}, steps=900, out=tmp_path, resume=True)
    for changed, message in [
        ({"pixels": {"marker": True}}, "hide the goal's marker"),
        ({"pixels": True, "preset": "book"}, "choose ddpg"),
        ({"pixels": True, "noise": {"observation": 0.1}}, "start and noise of observations"),
        ({}, "pixels is set"),
    ]:
        with pytest.raises(ValueError, match=message):
            fetch_env.train(**{**arguments, **changed})


def test_a_policy_acts_on_its_own_pictures_alone_and_among_many(student, tmp_path):
    student.save(tmp_path / "student.safetensors")
    policy = pickle.loads(pickle.dumps(fetch_env.Policy.load(tmp_path / "student.safetensors")))
    envs = fetch_env.FetchVectorEnv("FetchReach-v4", 3)
    seen, _ = envs.reset(seed=0)
    seen = {**seen, "pixels": envs.draw(**policy.view)}
    actions = policy(seen)
    assert actions.shape == (3, 4)
    for row, action in enumerate(actions):
        alone = {key: part[row] for key, part in seen.items()}
        np.testing.assert_array_equal(policy(alone), action)
    assert np.any(policy({**seen, "pixels": 255 - seen["pixels"]}) != actions)
    for pixels, message in [
        (None, "pixels is missing: the policy sees pictures"),
        (seen["pixels"][:, 1:], r"pixels has the shape \[3, 23, 24, 3\]"),
        (seen["pixels"] / 255, "pixels is no such array"),
    ]:
        with pytest.raises(ValueError, match=message):
            policy({**seen, "pixels": pixels})
    summary = fetch_env.evaluate("FetchReach-v4", policy, 3, num_threads=2)
    assert summary["episode_length_mean"]["value"] == 50
    with pytest.raises(ValueError, match="weights: the policy sees pictures"):
        policy.weights()
    assert fetch_env.Policy.shipped("FetchReach-v4").view is None


def test_a_teacher_may_be_a_policy_a_file_or_a_script(run, tmp_path):
    policy = fetch_env.Policy.shipped("FetchReach-v4")
    policy.save(tmp_path / "teacher.safetensors")
    trained, *others = [
        fetch_env.train(**{**run, "teacher": teacher}, steps=200).policy.__getstate__()
        for teacher in ("trained", policy, tmp_path / "teacher.safetensors", "scripted")
    ]
    assert trained == others[0] == others[1] != others[2]


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"teacher": "planned"}, "the planner is no teacher"),
        ({"teacher": "tariner"}, "there is no teacher tariner"),
        ({"teacher": 3}, "teacher is int: pass a fetch_env.Policy"),
        ({"preset": "book"}, "the preset book is of a learner without a teacher"),
        ({"start": fetch_env.Policy.shipped("FetchReach-v4")}, "start and noise of observations"),
        ({"noise": {"observation": 0.1}}, "start and noise of observations"),
        ({"pixels": {"width": 3}}, "pixels: pass True, or a dictionary"),
        ({"pixels": {"camera": "far"}}, 'camera is far: pass "near"'),
        ({"pixels": {"size": 4}}, "size is 4: pass a number from 16 to 512"),
    ],
)
def test_what_has_no_meaning_is_refused(run, changed, message):
    with pytest.raises((TypeError, ValueError), match=message):
        fetch_env.train(**{**run, **changed})


def test_a_student_of_pictures_is_no_teacher(run, student):
    for name in ("teacher", "start"):
        arguments = {**run, "teacher": None, "preset": "fast", name: student}
        if name == "teacher":
            arguments["preset"] = run["preset"]
        with pytest.raises(ValueError, match=f"{name}: the policy sees pictures"):
            fetch_env.train(**arguments)
