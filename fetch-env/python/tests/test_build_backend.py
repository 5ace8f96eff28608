"""The build backend finds the parts of an installation of MuJoCo."""

import importlib.util
import struct
import zipfile
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


#: For targets, the names of MuJoCo's library and of its decoders.
NAMES = {
    "x86_64-unknown-linux-gnu": ["libmujoco.so.3.6.0", "libstl_decoder.so", "libobj_decoder.so"],
    "aarch64-apple-darwin": [
        "libmujoco.3.6.0.dylib",
        "libstl_decoder.dylib",
        "libobj_decoder.dylib",
    ],
    "x86_64-pc-windows-gnu": ["mujoco.dll", "stl_decoder.dll", "obj_decoder.dll"],
}


@pytest.mark.parametrize("folder", [".", "lib"])
@pytest.mark.parametrize("target", NAMES)
def test_the_library_is_in_the_installation_or_in_its_lib(
    backend, tmp_path, monkeypatch, target, folder
):
    monkeypatch.setenv("CARGO_BUILD_TARGET", target)
    for path in (tmp_path / folder, tmp_path / "plugin"):
        path.mkdir(exist_ok=True)
    library = tmp_path / folder / NAMES[target][0]
    decoders = [tmp_path / "plugin" / name for name in NAMES[target][1:]]
    library.touch()
    with pytest.raises(RuntimeError, match="unset MUJOCO_DIR"):
        backend.parts_of(tmp_path)
    for decoder in decoders:
        decoder.touch()
    assert backend.parts_of(tmp_path) == (library, decoders)
    library.unlink()
    with pytest.raises(RuntimeError, match="unset MUJOCO_DIR"):
        backend.parts_of(tmp_path)


def test_a_target_without_a_library_is_refused(backend, tmp_path, monkeypatch):
    monkeypatch.setenv("CARGO_BUILD_TARGET", "x86_64-unknown-freebsd")
    with pytest.raises(RuntimeError, match="no library for x86_64-unknown-freebsd"):
        backend.parts_of(tmp_path)


def test_only_the_part_for_the_processor_is_taken(backend, monkeypatch):
    """The header of a library for several processors has their numbers, places and sizes."""
    parts = [struct.pack(">5I", kind, 0, at, 3, 0) for kind, at in ((16777223, 48), (16777228, 51))]
    code = struct.pack(">II", 0xCAFEBABE, 2) + b"".join(parts) + b"x86arm"
    monkeypatch.setenv("CARGO_BUILD_TARGET", "aarch64-apple-darwin")
    assert backend.thin(code) == b"arm"
    monkeypatch.setenv("CARGO_BUILD_TARGET", "x86_64-apple-darwin")
    assert backend.thin(code) == b"x86"
    assert backend.thin(b"of one processor") == b"of one processor"


def test_decoders_for_windows_get_the_library_by_its_own_name(backend, tmp_path, monkeypatch):
    monkeypatch.setattr(backend, "BUNDLE", tmp_path / "bundle")
    (tmp_path / "bundle/plugin").mkdir(parents=True)
    library, decoder = tmp_path / "mujoco.dll", tmp_path / "stl_decoder.dll"
    library.write_bytes(b"library")
    decoder.write_bytes(b"MZ\0mujoco.dll\0KERNEL32.dll\0mujoco.dll.txt")
    backend.on_windows(library, [decoder])
    (bundled,) = (tmp_path / "bundle").glob("*.dll")
    assert bundled.read_bytes() == b"library"
    changed = (tmp_path / "bundle/plugin/stl_decoder.dll").read_bytes()
    assert changed == decoder.read_bytes().replace(b"mujoco.dll\0", f"{bundled.name}\0".encode())
    assert len(changed) == decoder.stat().st_size


def test_a_wheel_that_is_compressed_again_has_the_same_files(backend, tmp_path):
    pytest.importorskip("zopfli")
    files = {"module.so": bytes(range(256)) * 100, "empty.py": b""}
    wheel = tmp_path / "package.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, contents in files.items():
            archive.writestr(name, contents)
    size = wheel.stat().st_size
    backend.compress(wheel)
    assert [path.name for path in tmp_path.iterdir()] == [wheel.name]
    assert wheel.stat().st_size < size
    with zipfile.ZipFile(wheel) as archive:
        assert {name: archive.read(name) for name in archive.namelist()} == files
