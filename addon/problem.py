"""What goes wrong or is approximated, said once and by name."""

from __future__ import annotations

from dataclasses import dataclass, field


class Problem(RuntimeError):
    """Something that the user has to change first; its text is one sentence for them."""


@dataclass
class Report:
    """Warnings of an export: one per object, light or node, each saying what was done instead."""

    lines: list[str] = field(default_factory=list)
    _seen: set[tuple[str, str]] = field(default_factory=set, repr=False)

    def warn(self, where: str, what: str) -> None:
        """Note `what` about `where` ("light 'Sun'"), once."""
        if (where, what) not in self._seen:
            self._seen.add((where, what))
            self.lines.append(f"{where}: {what}")
