"""The progress of a training on standard error."""

from __future__ import annotations

import shutil
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import TextIO

#: Held by the run that has the last line of the terminal. Nothing waits for it.
_LAST_LINE = threading.Lock()

#: Seconds between two changes of that line.
_INTERVAL = 0.1

_BAR = 30


class Progress:
    """A line that is replaced on a terminal, and otherwise a line for each evaluation.

    One run of the process at a time replaces a line; others write lines above it.
    """

    def __init__(self, name: str, steps: int) -> None:
        """Begin to show a run of at most ``steps`` steps."""
        self._name = name
        self._steps = steps
        self._stream: TextIO | None = sys.stderr
        self._success = ""
        self._drawn = 0.0
        self._is_terminal = self._asks_terminal()
        self._has_line = self._is_terminal and _LAST_LINE.acquire(blocking=False)

    def show(self, done: int, row: Mapping[str, Any] | None) -> None:
        """Show the number of steps so far, and the row of an evaluation if there was one."""
        if row is not None:
            self._success = f", success rate {row['success_rate']['value']:.2f}"
        if self._has_line:
            now = time.monotonic()
            if row is not None or now - self._drawn >= _INTERVAL:
                self._drawn = now
                self._write("\r" + self._fitted(self._text(done)))
        elif row is not None:
            text = self._text(done)
            # On a terminal, in place of another run's line, which that run writes again.
            self._write(f"\r{self._fitted(text)}\n" if self._is_terminal else f"{text}\n")

    def close(self) -> None:
        """Leave the line as it is."""
        if self._has_line:
            self._has_line = False
            if self._drawn:
                self._write("\n")
            _LAST_LINE.release()

    def _text(self, done: int) -> str:
        bar = "#" * (_BAR * min(done, self._steps) // max(self._steps, 1))
        steps = f"{done:,} of at most {self._steps:,} steps"
        return f"{self._name} [{bar:<{_BAR}}] {steps}{self._success}"

    @staticmethod
    def _fitted(text: str) -> str:
        """Return a text of one line of the terminal, with spaces over what was there."""
        width = shutil.get_terminal_size().columns - 1
        return text[:width].ljust(width)

    def _asks_terminal(self) -> bool:
        try:
            return self._stream is not None and self._stream.isatty()
        except (AttributeError, OSError, ValueError):
            return False

    def _write(self, text: str) -> None:
        """Write a text, or nothing from now on if nobody can read it."""
        try:
            if self._stream is not None:
                self._stream.write(text)
                self._stream.flush()
        except (AttributeError, OSError, ValueError):
            self._stream = None
