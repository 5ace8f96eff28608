"""The wheel that FETCH_ENV_WHEEL names: what is in it, and that it needs nothing else."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

WHEEL = os.environ.get("FETCH_ENV_WHEEL")
pytestmark = pytest.mark.skipif(WHEEL is None, reason="FETCH_ENV_WHEEL names no wheel")

#: What a user does, beside whatever else has loaded MuJoCo.
PROGRAM = """
import gymnasium
import fetch_env

assert "_mujoco" in str(fetch_env.library_path())
env = gymnasium.make("fetch_env/FetchPush-v4", render_mode="rgb_array", width=32, height=32)
env.reset(seed=42)
steps = [env.step(env.action_space.sample()) for _ in range(50)]
assert steps[-1][3]
assert env.render().std() > 0
"""


@pytest.fixture(scope="module")
def contents():
    with zipfile.ZipFile(WHEEL) as wheel:
        return {name: wheel.read(name) for name in wheel.namelist()}


def test_mujoco_comes_with_it(contents):
    names = {Path(name).name for name in contents}
    assert "libmujoco_fetch_env.so.3.6.0" in names
    assert {"libstl_decoder.so", "libobj_decoder.so"} <= names
    assert {"MUJOCO_LICENSE", "MUJOCO_LICENSES_THIRD_PARTY.md"} <= names
    assert {"py.typed", "_native.pyi"} <= names
    assert Path(WHEEL).stat().st_size <= 5 * 2**20


def test_it_knows_no_path_of_the_builder(contents):
    root = Path(__file__).resolve().parents[3]
    module = contents["fetch_env/_native.abi3.so"]
    for folder in (root, Path.home() / ".cargo", Path(sys.prefix)):
        assert str(folder).encode() not in module


@pytest.mark.parametrize(
    "beside", ["", "import mujoco; mujoco.MjModel.from_xml_string('<mujoco/>')"]
)
def test_it_runs_in_a_bare_environment(tmp_path, beside):
    python = tmp_path / "bin" / "python"
    packages = [WHEEL, "mujoco==4.0.0"] if beside else [WHEEL]
    for command in (
        [sys.executable, "-m", "venv", tmp_path],
        [python, "-m", "pip", "install", "--quiet", *packages],
        [python, "-W", "ignore", "-c", beside + PROGRAM],
    ):
        subprocess.run(command, check=True, cwd=tmp_path)  # noqa: S603
