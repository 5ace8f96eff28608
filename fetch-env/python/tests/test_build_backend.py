"""The build backend finds the parts of an installation of MuJoCo."""

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("maturin")


@pytest.fixture
def backend():
    """Return the build backend, which is no part of the package."""
    path = Path(__file__).resolve().parents[1] / "build_backend.py"
    spec = importlib.util.spec_from_file_location("build_backend", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("folder", [".", "lib"])
def test_the_library_is_in_the_installation_or_in_its_lib(backend, tmp_path, folder):
    for path in (tmp_path / folder, tmp_path / "plugin"):
        path.mkdir(exist_ok=True)
    library = tmp_path / folder / "libmujoco.so.3.6.0"
    library.touch()
    with pytest.raises(RuntimeError, match="unset MUJOCO_DIR"):
        backend.library_of(tmp_path)
    for name in backend.DECODERS:
        (tmp_path / "plugin" / name).touch()
    assert backend.library_of(tmp_path) == library
    library.unlink()
    with pytest.raises(RuntimeError, match="unset MUJOCO_DIR"):
        backend.library_of(tmp_path)
