"""The program ``fetch-env``."""

from __future__ import annotations

import os
import signal
import sys
from typing import TYPE_CHECKING

from . import _native

if TYPE_CHECKING:
    from .task import Task


def main(task: Task | None = None) -> int:
    """Run the program ``fetch-env`` with the arguments of the process, and return its exit code.

    A script that ends with ``sys.exit(fetch_env.main(Stack()))`` is the program for that task::

        python stack.py train --env-id FetchPickAndPlace-v4 --out stack
        python stack.py evaluate --env-id FetchPickAndPlace-v4 --policy stack/policy.safetensors

    Args:
        task: A task of your own for ``train``, ``evaluate``, ``robustness``, ``play``, ``plan`` and
            ``collect``; ``--env-id`` names the environment on which it builds. What it raises
            reaches the caller as it is.
    """
    # Python's own handler would wait for the end of the command. A shell's background programs
    # ignore the signal.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    # No file that the program opens may take the place of a stream that is closed.
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:  # noqa: PLR2004
        os.set_inheritable(descriptor, True)  # noqa: FBT003
    os.close(descriptor)
    return _native.run_program(sys.argv[1:], task)
