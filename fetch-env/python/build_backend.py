"""The build backend: maturin's, with MuJoCo next to the compiled module.

The build requirement `mujoco` has the headers to compile with, and the library and the decoders of
meshes that the package includes.

If MUJOCO_DIR is set, that installation is used and included instead. To build for another system or
processor, set CARGO_BUILD_TARGET, and MUJOCO_DIR to a MuJoCo for it: `cargo xtask wheels` does.
"""

import os
import platform
import shutil
import struct
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

from maturin import build_editable as maturin_build_editable
from maturin import build_sdist as maturin_build_sdist
from maturin import build_wheel as maturin_build_wheel
from maturin import (  # noqa: F401
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

try:
    from zopfli import ZipFile as ZopfliFile
except ImportError:
    # Only wheels to hand on are made with it (zopflipy).
    ZopfliFile = None

HERE = Path(__file__).resolve().parent
BUNDLE = HERE / "python" / "fetch_env" / "_mujoco"


def package():
    """Return the folder of the build requirement `mujoco`, or nothing if it is not installed."""
    spec = find_spec("mujoco")
    return None if spec is None or spec.origin is None else Path(spec.origin).parent


def installation():
    """Return the folder of the MuJoCo to build with."""
    if chosen := os.environ.get("MUJOCO_DIR"):
        return Path(chosen)
    if found := package():
        return found
    message = "install the build requirement mujoco, or set MUJOCO_DIR to an installation"
    raise RuntimeError(message)


def copy(source, target):
    """Copy a library without the symbols that only debuggers read."""
    strip = shutil.which("strip")
    command = [strip, "--strip-unneeded", "-o", target, source]
    # It refuses libraries of other processors.
    if strip is None or subprocess.run(command, check=False).returncode != 0:
        shutil.copyfile(source, target)


def patch(*arguments):
    """Change the names in a library."""
    subprocess.run(["patchelf", *map(str, arguments)], check=True)


def on_linux(library, decoders):
    """Bundle MuJoCo under a name of its own, so that it never meets another copy in the process."""
    own_name = library.name.replace("libmujoco.", "libmujoco_fetch_env.")
    copy(library, BUNDLE / own_name)
    patch("--set-soname", own_name, BUNDLE / own_name)
    for source in decoders:
        decoder = BUNDLE / "plugin" / source.name
        copy(source, decoder)
        patch("--replace-needed", library.name, own_name, decoder)
        patch("--set-rpath", "$ORIGIN/..", decoder)


def on_windows(library, decoders):
    """Bundle MuJoCo under a name of its own, which is as long as the one in the decoders."""
    own_name = "mujofe.dll"
    shutil.copyfile(library, BUNDLE / own_name)
    for source in decoders:
        parts = source.read_bytes().split(f"{library.name}\0".encode())
        (BUNDLE / "plugin" / source.name).write_bytes(f"{own_name}\0".encode().join(parts))


def on_macos(library, decoders):
    """Bundle the parts for one processor, unchanged, because that would undo their signatures."""
    for folder, source in [(".", library), *(("plugin", decoder) for decoder in decoders)]:
        (BUNDLE / folder / source.name).write_bytes(thin(source.read_bytes()))


def thin(code):
    """Return the part for the target's processor of a library that has several."""
    if not code.startswith(b"\xca\xfe\xba\xbe"):
        return code
    wanted = 0x01000007 if target().startswith("x86_64") else 0x0100000C
    (count,) = struct.unpack_from(">I", code, 4)
    parts = struct.iter_unpack(">5I", code[8 : 8 + 20 * count])
    offset, size = next(part[2:4] for part in parts if part[0] == wanted)
    return code[offset : offset + size]


#: For each system, as Rust and Python name it: the names of MuJoCo's library and of its decoders,
#: and what bundles them.
SYSTEMS = {
    "linux": ("libmujoco.so.*", "lib{}_decoder.so", on_linux),
    "darwin": ("libmujoco.*.dylib", "lib{}_decoder.dylib", on_macos),
    "win": ("mujoco.dll", "{}_decoder.dll", on_windows),
}


def target():
    """Return the names of the processor and of the system to build for."""
    return os.environ.get("CARGO_BUILD_TARGET") or f"{platform.machine()}-{sys.platform}"


def system():
    """Return what is known of the system to build for."""
    for name, known in SYSTEMS.items():
        if name in target():
            return known
    message = f"MuJoCo has no library for {target()}: build on Linux, macOS or Windows"
    raise RuntimeError(message)


def parts_of(mujoco):
    """Return the library of an installation, and the decoders, which it must have, too."""
    pattern, decoder, _ = system()
    libraries = [*mujoco.glob(pattern), *mujoco.glob(f"lib/{pattern}")]
    decoders = [mujoco / "plugin" / decoder.format(kind) for kind in ("stl", "obj")]
    if len(libraries) == 1 and all(path.exists() for path in decoders):
        return libraries[0], decoders
    message = (
        f"{mujoco} does not have one {pattern}, in it or in its lib, and the decoders "
        f"{', '.join(path.name for path in decoders)} in its plugin: unset MUJOCO_DIR to use the "
        "build requirement mujoco"
    )
    raise RuntimeError(message)


def bundle(mujoco):
    """Put MuJoCo's library, its decoders and its licenses into the package."""
    library, decoders = parts_of(mujoco)
    shutil.rmtree(BUNDLE, ignore_errors=True)
    (BUNDLE / "plugin").mkdir(parents=True)
    _, _, bundle_parts = system()
    bundle_parts(library, decoders)
    # Installations for other processors have no copy of them.
    for terms in (package() or mujoco).parent.glob("mujoco-*.dist-info/licenses/*"):
        shutil.copyfile(terms, BUNDLE / f"MUJOCO_{terms.name}")


def prepare():
    """Bundle MuJoCo, and keep the paths of this machine out of the module."""
    mujoco = installation()
    bundle(mujoco)
    os.environ["MUJOCO_DIR"] = str(mujoco)
    cargo = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))
    # The last prefix that matches counts.
    names = {HERE.parents[1]: "fetch-env", cargo: "cargo", cargo / "registry" / "src": "crates"}
    flags = [f"--remap-path-prefix={path}={name}" for path, name in names.items()]
    arguments = os.environ.get("MATURIN_PEP517_ARGS", "")
    if "--profile wheel" in arguments:
        # A smaller wheel. What is inlined in hot loops is small, or marked.
        flags.append("-Cllvm-args=-inline-threshold=50")
    os.environ["CARGO_ENCODED_RUSTFLAGS"] = "\x1f".join(flags)
    os.environ["MATURIN_PEP517_ARGS"] = f"{arguments} --compression-level 9".strip()


def compress(wheel):
    """Compress a wheel again, by as much as its format allows, which takes a minute."""
    smaller = wheel.with_suffix(".smaller")
    with zipfile.ZipFile(wheel) as old, ZopfliFile(smaller, "w", iterations=5) as new:
        for entry in old.infolist():
            new.writestr(entry, old.read(entry))
    smaller.replace(wheel)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel."""
    prepare()
    name = maturin_build_wheel(wheel_directory, config_settings, metadata_directory)
    if ZopfliFile:
        compress(Path(wheel_directory) / name)
    return name


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel that refers to the source tree."""
    prepare()
    return maturin_build_editable(wheel_directory, config_settings, metadata_directory)


def build_sdist(sdist_directory, config_settings=None):
    """Pack the sources."""
    return maturin_build_sdist(sdist_directory, config_settings)
