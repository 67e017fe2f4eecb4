"""What a run has found, as a table by what is in the scenes."""

from __future__ import annotations

from collections import Counter
from typing import Any


class Summary:
    """Counts of scenes and findings."""

    def __init__(self) -> None:
        self.count = 0
        self.failed = 0
        self._scenes: Counter[str] = Counter()
        self._wrong: dict[str, Counter[str]] = {}
        self._told: Counter[str] = Counter()

    def add(self, found: dict[str, Any]) -> None:
        """Count one scene's result."""
        self.count += 1
        self.failed += bool(found["wrong"])
        for kind in ("all", *found["kinds"]):
            self._scenes[kind] += 1
            for check in found["wrong"]:
                self._wrong.setdefault(check, Counter())[kind] += 1
        self._told.update(found["told"])

    def __str__(self) -> str:
        checks = sorted(self._wrong)
        width = max(map(len, self._scenes), default=4)
        lines = [" ".join([f"{'':{width}}   scenes", *(f"{check:>10}" for check in checks)])]
        for kind in ["all", *sorted(set(self._scenes) - {"all"})]:
            counts = [f"{self._wrong[check][kind]:>10}" for check in checks]
            lines.append(" ".join([f"{kind:{width}} {self._scenes[kind]:>8}", *counts]))
        lines += [f"told by warnings: {word}: {count} scenes" for word, count in sorted(self._told.items())]
        return "\n".join(lines)
