"""Pictures: cameras, sizes, kinds, and the marker."""

import copy
import json
import pickle

import fetch_env
import gymnasium
import numpy as np
import pytest

CAMERAS = ("free", "head_camera_rgb", "gripper_camera_rgb", "external_camera_0", "lidar")

#: Straight down onto the table's edge nearest to -y: its top is 2 m below, the floor 2.4 m.
DOWN = {"lookat": [1.5, 0.45, 0.4], "distance": 2.0, "azimuth": 90.0, "elevation": -90.0}


def test_each_camera_sees_something_else_and_names_are_known(push):
    assert sorted(push.camera_names) == sorted(CAMERAS)
    seen = {push.draw(48, 48, camera=name).tobytes() for name in push.camera_names}
    assert len(seen) == len(CAMERAS)
    with pytest.raises(ValueError, match=r"no camera wrist: use one of .*gripper_camera_rgb"):
        push.draw(camera="wrist")


def test_sizes_and_kinds_are_those_of_the_call(push):
    before = push.get_state()
    for width, height in ((40, 30), (64, 64), (40, 30), (1, 3)):
        assert push.draw(width, height).shape == (height, width, 3)
        assert push.draw(width, height, kind="depth").shape == (height, width)
        assert push.draw(width, height, kind="segmentation").shape == (height, width, 2)
    assert push.draw().shape == (480, 480, 3)
    assert push.draw(width=20).shape == (480, 20, 3)
    kinds = {kind: push.draw(8, 8, kind=kind).dtype for kind in ("rgb", "depth", "segmentation")}
    assert kinds == {"rgb": np.uint8, "depth": np.float32, "segmentation": np.int32}
    assert push.get_state() == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"width": 0}, "0 x 480 pixels"),
        ({"height": 4097}, "choose 1 to 4096"),
        ({"width": -1}, "out of range"),
        ({"samples": 256}, "out of range"),
        ({"kind": "rgbd"}, '"segmentation"'),
        ({"camera": 3}, "camera_names"),
        ({"camera": {"distance": 0.0}}, "distance"),
        ({"camera": {"azimuth": np.nan}}, "azimuth"),
        ({"camera": {"lookat": [0.0, 1.0]}}, "lookat"),
        ({"camera": {"trackbodyid": 1}}, "no .trackbodyid.: pass distance"),
    ],
)
def test_what_cannot_be_drawn_is_an_error(push, arguments, message):
    with pytest.raises(ValueError, match=message):
        push.draw(**arguments)
    assert push.draw(8, 8).std() > 0


def test_an_argument_of_another_type_is_named(push):
    with pytest.raises(TypeError, match="width: 'str'"):
        push.draw("wide")


def test_the_camera_of_an_environment_is_chosen_as_in_gymnasium(push):
    closer = {"distance": 1.5, "lookat": np.array([1.3, 0.75, 0.5])}
    size = {"width": 60, "height": 50}
    made = {"render_mode": "rgb_array", "default_camera_config": closer, **size}
    env = gymnasium.make("fetch_env/FetchPush-v4", **made)
    env.reset(seed=0)
    expected = push.draw(60, 50, camera={**closer, "azimuth": 132.0, "elevation": -14.0})
    assert np.array_equal(env.render(), expected)
    assert not np.array_equal(expected, push.draw(60, 50))
    assert np.array_equal(env.unwrapped.draw(camera="free"), expected)
    assert json.loads(env.spec.to_json())["kwargs"]["default_camera_config"]["distance"] == 1.5
    for again in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        assert np.array_equal(again.render(), expected)
    named = gymnasium.make("fetch_env/FetchPush-v4", camera_name="lidar", **made)
    named.reset(seed=0)
    assert np.array_equal(named.render(), push.draw(60, 50, camera="lidar"))
    assert np.array_equal(named.unwrapped.draw(camera="free"), expected)
    for wrong in ({"camera_name": "wrist"}, {"default_camera_config": {"type": 1}}):
        with pytest.raises(ValueError, match="camera"):
            fetch_env.FetchEnv("FetchPush-v4", **wrong)


def test_the_marker_is_shown_or_not(push):
    """Without it only the pixels that show it, and the edges around them, look otherwise."""
    push.goal = [1.35, 1.0, 0.6]
    shown = push.draw(240, 240, samples=0)
    hidden = push.draw(240, 240, samples=0, marker=False)
    segments, without = (
        push.draw(240, 240, kind="segmentation", marker=marker) for marker in (True, False)
    )
    marker = segments[..., 1] == 6
    marker &= without[..., 1] != 6
    assert 10 < marker.sum() < 100
    assert np.array_equal((shown != hidden).any(axis=2), marker)
    assert np.array_equal(push.draw(240, 240, samples=0), shown)


def test_depth_is_in_meters(push):
    depth = push.draw(96, 64, camera=DOWN, kind="depth")
    assert depth[32, 48] == pytest.approx(2.0, abs=1e-3)
    assert depth[40, 48] == pytest.approx(2.4, abs=1e-3)


def test_segmentation_has_the_ids_of_the_model(push):
    mujoco = pytest.importorskip("mujoco")
    above = {"lookat": push.data.body("object0").xpos, "distance": 0.5, "elevation": -90.0}
    segments = push.draw(48, 48, camera=above, kind="segmentation", marker=False)
    geom = int(mujoco.mjtObj.mjOBJ_GEOM)
    assert segments[24, 24].tolist() == [push.model.geom("object0").id, geom]
    assert (segments == [push.model.geom("table0").id, geom]).all(axis=2).sum() > 100
    assert push.draw(48, 48, kind="segmentation")[0, 0].tolist() == [-1, -1]


def test_a_vector_draws_what_single_environments_do():
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 5, camera_name="external_camera_0")
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.draw(8, 8)
    envs.reset(seed=3)
    single = fetch_env.FetchEnv("FetchPush-v4", camera_name="external_camera_0")
    assert envs.camera_names == single.camera_names
    calls = (
        {},
        {"width": 84, "height": 84, "samples": 0, "camera": "gripper_camera_rgb"},
        {"width": 50, "height": 40, "camera": {"distance": 2.0}, "marker": False},
        {"width": 50, "height": 40, "kind": "depth"},
        {"width": 50, "height": 40, "kind": "segmentation", "camera": "free"},
    )
    for arguments in calls:
        pictures = envs.draw(**arguments)
        assert pictures.flags.c_contiguous
        for env_index, picture in enumerate(pictures):
            single.reset(seed=3 + env_index)
            assert np.array_equal(picture, single.draw(**arguments))
    with pytest.raises(AttributeError, match="draw"):
        _ = envs.mujoco_renderer
    envs.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        envs.draw(8, 8)


def test_programs_find_gymnasiums_renderer():
    env = fetch_env.FetchEnv("FetchPush-v4", render_mode="rgb_array", width=40, height=30)
    env.reset(seed=0)
    renderer = env.mujoco_renderer
    assert np.array_equal(renderer.render("rgb_array"), env.render())
    assert np.array_equal(renderer.render("depth_array"), env.draw(kind="depth"))
    assert [part.shape for part in renderer.render("rgbd_tuple")] == [(30, 40, 3), (30, 40)]
    renderer.camera_id = 0
    assert np.array_equal(env.render(), env.draw(camera=env.camera_names[1]))
    renderer.camera_id, renderer.default_cam_config, renderer.width = -1, {"distance": 1.0}, 20
    assert np.array_equal(env.render(), env.draw(20, 30, camera={"distance": 1.0}))
    with pytest.raises(ValueError, match="human"):
        renderer.render("human")
