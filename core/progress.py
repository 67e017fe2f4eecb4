"""A progress bar for the terminal."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TextIO

WIDTH = 24  # characters of the bar
REDRAW = 0.1  # seconds between two updates on a terminal
LINE = 10.0  # seconds between two lines if the output is not a terminal (a log file)


class ProgressBar:
    """A bar that is redrawn in place on a terminal, or printed as occasional lines to a log.

    Parameters
    ----------
    label
        Name of the work, shown before the bar.
    stream
        Output stream; None: stderr. Nothing is written if stderr does not exist, as in a GUI process on Windows.
    """

    def __init__(self, label: str, stream: TextIO | None = None) -> None:
        self.label = label
        self.stream = sys.stderr if stream is None else stream
        self.live = bool(self.stream and self.stream.isatty())
        self.started = time.monotonic()
        self.drawn = -float("inf")
        self.length = 0
        self.complete = False  # the last drawing showed the end

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.live and self.length:
            self._write("\n")

    def update(self, fraction: float, note: str = "") -> None:
        """Show progress `fraction`, in [0, 1], and a short note after the bar."""
        now = time.monotonic()
        ends = fraction >= 1.0 and not self.complete
        if not ends and now - self.drawn < (REDRAW if self.live else LINE):
            return
        self.drawn = now
        self.complete = fraction >= 1.0
        text = self._text(min(max(fraction, 0.0), 1.0), now - self.started, note)
        if self.live:
            self._write("\r" + text.ljust(self.length))
        else:
            self._write(text + "\n")
        self.length = len(text)

    def _text(self, fraction: float, seconds: float, note: str) -> str:
        full = round(WIDTH * fraction)
        left = f", {seconds * (1.0 - fraction) / fraction:.0f} s left" if 0.02 < fraction < 1.0 else ""
        bar = "#" * full + "." * (WIDTH - full)
        return f"{self.label} [{bar}] {fraction:4.0%} {seconds:.1f} s{left}  {note}".rstrip()

    def _write(self, text: str) -> None:
        if self.stream is None:
            return
        try:
            self.stream.write(text)
            self.stream.flush()
        except (OSError, ValueError):  # a closed pipe must not stop the work
            self.stream = None
