"""The reference's model, with the vendor's meshes."""

import subprocess
import sys
import tempfile
from pathlib import Path

from . import _native


def download_reference_model() -> Path:
    """Download the model of gymnasium-robotics 1.4.2 into the user's cache, and return its folder.

    Afterwards ``model="reference"`` finds it. This interpreter's pip downloads it, from its
    configured index; every file is checked. The meshes are under CC BY-NC-SA 4.0: they
    may not be used commercially.
    """
    with tempfile.TemporaryDirectory() as folder:
        download = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
        package = f"gymnasium-robotics=={_native.REFERENCE_VERSION}"
        subprocess.run([*download, "--dest", folder, package], check=True)  # noqa: S603
        (wheel,) = Path(folder).glob("*.whl")
        return _native.unpack_reference_model(wheel)


def library_path() -> Path:
    """Return the path of MuJoCo's library, loading the library first if necessary."""
    return _native.library_path()


def has_reference_model() -> bool:
    """Tell whether :func:`download_reference_model` was called before."""
    return _native.has_reference_model()
