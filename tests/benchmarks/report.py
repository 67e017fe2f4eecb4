"""The report of `versus_mitsuba` as Markdown."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.benchmarks.fresh_process import FirstPicture


@dataclass
class Side:
    """Median seconds of a picture, and its variance."""

    seconds: float
    variance: float

    @property
    def cost(self) -> float:
        """Seconds for a variance of 1."""
        return self.seconds * self.variance


@dataclass
class RenderRow:
    """One scene and number of samples.

    `mitsuba` is by "integrator, sampler". `time_ratio` is Edgegrad's seconds / the fastest of Mitsuba's; `cost_ratio`
    is (seconds x variance) of the cheapest of Mitsuba's / Edgegrad's, and `cost_ratio_default` that of Mitsuba's
    default sampler. `difference` is the relative RMS difference of block averages, `expected` what noise alone gives.
    """

    scene: str
    spp: int
    edgegrad: Side
    mitsuba: dict[str, Side]
    time_ratio: float
    cost_ratio: float
    cost_ratio_default: float
    difference: float
    expected: float


@dataclass
class FirstRow:
    """First picture in a fresh process; Mitsuba with an empty cache of compiled kernels, and with a filled one."""

    scene: str
    edgegrad: FirstPicture
    mitsuba_empty_cache: FirstPicture
    mitsuba: FirstPicture


@dataclass
class Report:
    """One run."""

    machine: dict[str, Any]
    render: list[RenderRow] = field(default_factory=list)
    first: list[FirstRow] = field(default_factory=list)



def geometric_mean(values: Iterable[float]) -> float:
    """exp of the mean logarithm."""
    return float(np.exp(np.mean(np.log(list(values)))))


def markdown(report: Report) -> str:
    """The report as text."""
    about = ", ".join(f"{key} {value}" for key, value in report.machine.items())
    lines = [f"# Edgegrad beside Mitsuba 3\n\n{about}. Seconds are medians of warm calls.\n", *_render(report)]
    if report.first:
        lines += _first(report)
    return "\n".join(lines) + "\n"


def _render(report: Report) -> list[str]:
    lines = [
        "## Pictures\n",
        "Time: Edgegrad's seconds / those of the fastest of Mitsuba's integrators and samplers (smaller is better). "
        "Seconds × variance: that of the best of Mitsuba's / Edgegrad's (larger is better); *default* is against the "
        "better of Mitsuba's integrators with its default sampler. Difference: of the block averages, and what noise "
        "alone gives.\n",
        "| scene | spp | Edgegrad s | Mitsuba s | time | variance | best of Mitsuba's | seconds × variance | default "
        "| difference (noise) |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for r in report.render:
        fastest = min(r.mitsuba.values(), key=lambda side: side.seconds)
        best = min(r.mitsuba, key=lambda key: r.mitsuba[key].cost)
        lines.append(
            f"| {r.scene} | {r.spp} | {r.edgegrad.seconds:.4f} | {fastest.seconds:.4f} | **{r.time_ratio:.2f}** | "
            f"{r.edgegrad.variance:.2e} | {r.mitsuba[best].variance:.2e} ({best}) | **{r.cost_ratio:.2f}** | "
            f"{r.cost_ratio_default:.2f} | {r.difference:.1e} ({r.expected:.1e}) |"
        )
    for spp in sorted({r.spp for r in report.render}):
        rows = [r for r in report.render if r.spp == spp]
        time, cost, default = (
            [getattr(r, key) for r in rows] for key in ("time_ratio", "cost_ratio", "cost_ratio_default")
        )
        lines.append(
            f"\n{spp} spp, geometric means: time **{geometric_mean(time):.2f}** (worst {max(time):.2f}), "
            f"seconds × variance **{geometric_mean(cost):.2f}** (worst {min(cost):.2f}), against the default sampler "
            f"{geometric_mean(default):.2f} (worst {min(default):.2f})."
        )
    return lines


def _first(report: Report) -> list[str]:
    lines = [
        "\n## First picture in a fresh process\n",
        "Scene construction and first render at 16 spp, after the import; Mitsuba with an empty and with a filled "
        "cache of compiled kernels. Memory is the peak of the process.\n",
        "| scene | Edgegrad s (import) | Mitsuba s (import) | cache filled | Mitsuba / Edgegrad | Edgegrad MiB "
        "| Mitsuba MiB |",
        "|---|---|---|---|---|---|---|",
    ]
    for r in report.first:
        a, b, c = r.edgegrad, r.mitsuba_empty_cache, r.mitsuba
        lines.append(
            f"| {r.scene} | {a.seconds:.3f} ({a.import_seconds:.2f}) | {b.seconds:.2f} ({b.import_seconds:.2f}) | "
            f"{c.seconds:.3f} | **{b.seconds / a.seconds:.1f}**, {c.seconds / a.seconds:.1f} | {a.peak_mib:.0f} | "
            f"{b.peak_mib:.0f} |"
        )
    empty, filled = ([getattr(r, key).seconds / r.edgegrad.seconds for r in report.first]
                     for key in ("mitsuba_empty_cache", "mitsuba"))
    memory = [r.edgegrad.peak_mib / r.mitsuba_empty_cache.peak_mib for r in report.first]
    lines.append(
        f"\nGeometric means: **{geometric_mean(empty):.1f}×** sooner with an empty cache (worst {min(empty):.1f}), and "
        f"{geometric_mean(filled):.1f}× with a filled one (worst {min(filled):.1f}); memory "
        f"{geometric_mean(memory):.2f}× (worst {max(memory):.2f})."
    )
    return lines
