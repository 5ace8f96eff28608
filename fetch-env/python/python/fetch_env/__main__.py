"""The program ``fetch-env``, also as ``python -m fetch_env``."""

import os
import signal
import sys

from . import _native


def main() -> int:
    """Run the program with the arguments of the process, and return its exit code."""
    # Python's own handler would wait for the end of the command. A shell's background programs
    # ignore the signal.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    # No file that the program opens may take the place of a stream that is closed.
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:  # noqa: PLR2004
        os.set_inheritable(descriptor, True)  # noqa: FBT003
    os.close(descriptor)
    return _native.run_program(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
