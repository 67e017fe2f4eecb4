"""The progress of a fit whose parts follow one another: a search, trials, the fit itself, its standard errors."""

from __future__ import annotations

from dataclasses import dataclass

from ..rendering.options import Progress


@dataclass
class Stages:
    """Reports the progress of what follows one after the other as that of the whole."""

    report: Progress | None
    last: float = 0.0  # part of the whole that follows the fit
    done: float = 0.0

    def part(self, size: float) -> Progress | None:
        """Return the progress of the next part of the whole, which begins where the last one has ended."""
        if self.report is None:
            return None
        report, first = self.report, self.done
        self.done = min(self.done + size, 1.0)
        return lambda fraction: report(min(first + size * fraction, 1.0))

    def rest(self) -> Progress | None:
        """Return the progress of the fit itself: of all that is left before the last part."""
        return self.part(1.0 - self.last - self.done)
