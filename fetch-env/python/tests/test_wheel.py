"""The wheel that FETCH_ENV_WHEEL names: what is in it, and that it needs nothing else."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

WHEEL = os.environ.get("FETCH_ENV_WHEEL")
pytestmark = pytest.mark.skipif(WHEEL is None, reason="FETCH_ENV_WHEEL names no wheel")

#: What a user does, besides whatever else has loaded MuJoCo. The reference's meshes need decoders.
PROGRAM = """
import gymnasium
import fetch_env

assert "_mujoco" in str(fetch_env.library_path())
for model in ("builtin", "reference"):
    pictures = {"render_mode": "rgb_array", "width": 32, "height": 32}
    env = gymnasium.make("fetch_env/FetchPush-v4", model=model, **pictures)
    env.reset(seed=42)
    steps = [env.step(env.action_space.sample()) for _ in range(50)]
    assert steps[-1][3]
    assert env.render().std() > 0
"""

#: A second interpreter in the process of the first.
SUBINTERPRETER = """
import sys
import fetch_env

new = sys.version_info >= (3, 13)
interpreters = __import__("_interpreters" if new else "_xxsubinterpreters")
failed = None
try:
    failed = interpreters.run_string(interpreters.create(), "import fetch_env")
except Exception as error:
    failed = error
assert "ImportError" in str(failed), failed
fetch_env.FetchEnv("FetchPush-v4").reset(seed=0)
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
    assert Path(WHEEL).stat().st_size <= 7_500_000


def test_the_licenses_come_with_it(contents):
    root = Path(__file__).resolve().parents[3]
    for name in ("LICENSE-MIT", "LICENSE-APACHE"):
        terms = [path for path in contents if path.endswith(f".dist-info/licenses/{name}")]
        assert [contents[path] for path in terms] == [(root / name).read_bytes()]


def test_it_knows_no_path_of_the_builder(contents):
    root = Path(__file__).resolve().parents[3]
    module = contents["fetch_env/_native.abi3.so"]
    for folder in (root, Path.home() / ".cargo", Path(sys.prefix)):
        assert str(folder).encode() not in module


def other_pythons():
    """Return the oldest and the newest of the other Pythons that are installed next to this."""
    folders = Path(sys.base_prefix).parent.glob("3.*/bin")
    others = {int(folder.parent.name.split(".")[1]): folder / "python3" for folder in folders}
    minors = sorted(minor for minor in others if minor >= 10 and minor != sys.version_info.minor)
    return [pytest.param(others[minor], id=f"3.{minor}") for minor in minors[:1] + minors[1:][-1:]]


def run_in_bare_environment(folder, python, packages, program):
    """Make a virtual environment with the wheel, and run a program in it."""
    inside = folder / "bin" / "python"
    for command in (
        [python, "-m", "venv", folder],
        [inside, "-m", "pip", "install", "--quiet", WHEEL, *packages],
        [inside, "-W", "ignore", "-c", program],
    ):
        subprocess.run(command, check=True, cwd=folder)  # noqa: S603


@pytest.mark.usefixtures("reference")
@pytest.mark.parametrize("python", [pytest.param(sys.executable, id="this"), *other_pythons()])
def test_it_runs_in_a_bare_environment(tmp_path, python):
    run_in_bare_environment(tmp_path, python, [], PROGRAM)


@pytest.mark.usefixtures("reference")
def test_it_runs_beside_another_mujoco(tmp_path):
    other = "import mujoco; mujoco.MjModel.from_xml_string('<mujoco/>')"
    run_in_bare_environment(tmp_path, sys.executable, ["mujoco==4.0.0"], other + PROGRAM)


def test_a_subinterpreter_is_refused():
    """NumPy refuses to be loaded twice in a process."""
    subprocess.run([sys.executable, "-c", SUBINTERPRETER], check=True)  # noqa: S603
