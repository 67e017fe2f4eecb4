"""What goes wrong, is approximated or was read, said once and by name."""

from __future__ import annotations

from dataclasses import dataclass, field


class Problem(RuntimeError):
    """Something that the user has to change first; its text is one sentence for them."""


@dataclass
class Report:
    """What an export has to say.

    Attributes
    ----------
    lines
        Warnings: one per object, light or node, each saying what was done instead.
    readings
        One per material and world, saying what was read, baked or approximated, and per scene, of settings that
        renders here don't have.
    """

    lines: list[str] = field(default_factory=list)
    readings: list[str] = field(default_factory=list)
    _seen: set[tuple[str, str]] = field(default_factory=set, repr=False)

    def warn(self, where: str, what: str) -> None:
        """Note that `what` differs about `where` ("light 'Sun'"), once."""
        self._add(self.lines, where, what)

    def tell(self, where: str, what: str) -> None:
        """Note how `where` was read, once."""
        self._add(self.readings, where, what)

    def _add(self, lines: list[str], where: str, what: str) -> None:
        if (where, what) not in self._seen:
            self._seen.add((where, what))
            lines.append(f"{where}: {what}")
