"""A table of the results of a run, by the contents of the scenes."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np


class Summary:
    """Counts of scenes and findings."""

    def __init__(self) -> None:
        self.count = 0
        self.failed = 0
        self._scenes: Counter[str] = Counter()
        self._wrong: dict[str, Counter[str]] = {}
        self._told: Counter[str] = Counter()
        self._compared: list[dict[str, Any]] = []
        self._cpu = 0.0

    def add(self, found: dict[str, Any]) -> None:
        """Count one result."""
        self.count += 1
        self.failed += bool(found["wrong"])
        self._cpu += found["cpu"]
        if "shader" in found:
            self._compared.append(found)
            return
        for kind in ("all", *found["kinds"]):
            self._scenes[kind] += 1
            for check in found["wrong"]:
                self._wrong.setdefault(check, Counter())[kind] += 1
        self._told.update(found["told"])

    def __str__(self) -> str:
        parts = [self._scene_table()] if self._scenes else []
        parts += [self._comparison_table()] if self._compared else []
        return "\n\n".join([*parts, f"{self._cpu / max(self.count, 1):.3f} s of processor time each"])

    def _scene_table(self) -> str:
        checks = sorted(self._wrong)
        width = max(map(len, self._scenes), default=4)
        lines = [" ".join([f"{'':{width}}   scenes", *(f"{check:>10}" for check in checks)])]
        for kind in ["all", *sorted(set(self._scenes) - {"all"})]:
            counts = [f"{self._wrong[check][kind]:>10}" for check in checks]
            lines.append(" ".join([f"{kind:{width}} {self._scenes[kind]:>8}", *counts]))
        lines += [f"told: {word}: {count} scenes" for word, count in sorted(self._told.items())]
        return "\n".join(lines)

    def _comparison_table(self) -> str:
        """By shader and by parameter: how large deviates are, which for right derivatives are those of chance."""
        lines = [f"{'comparisons':24} compared  missing    wrong  precision   |z| 50 %   95 %   99 %    all"]
        for key in ("shader", "parameter"):
            for name in sorted({found[key] for found in self._compared}):
                lines.append(_comparison_row(name, [found for found in self._compared if found[key] == name]))
            lines.append("")
        chance = f"{'by chance':24} {'':8} {'':8} {'':8} {'':10}      0.67   1.96   2.58"
        return "\n".join([*lines, _comparison_row("all", self._compared), chance])


def _comparison_row(name: str, found: list[dict[str, Any]]) -> str:
    """Counts, the median of the standard error relative to the value, and quantiles of |z|.

    Only first rounds: those that were done again are a selection.
    """
    compared = [f for f in found if f["z"]]
    row = f"{name:24} {len(compared):8} {len(found) - len(compared):8} {sum(bool(f['wrong']) for f in found):8}"
    z = np.abs([z for f in compared for z in f["first"] if z != 0.0])
    if not len(z):
        return row
    moving = [f["values"] for f in compared if any(f["values"][:2])]
    precision = np.median([v[2] / max(abs(v[0]), abs(v[1])) for v in moving]) if moving else 0.0
    quantiles = "".join(f" {q:6.2f}" for q in np.quantile(z, (0.5, 0.95, 0.99, 1.0)))
    return f"{row} {precision:10.3f}    {quantiles}"
