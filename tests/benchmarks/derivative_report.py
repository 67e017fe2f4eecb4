"""The report of `derivatives`: Markdown that docs/measurements.md can take, and plots of error against seconds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.benchmarks.report import geometric_mean


@dataclass
class Timed:
    """A derivative at one number of samples.

    `variance` is that of one call from seed to seed, relative to the squared norm of the mean, and `error` the relative
    RMS error of one call against the central differences, their noise taken out (None: there are none).
    """

    seconds: float
    variance: float
    error: float | None = None

    @property
    def cost(self) -> float:
        """Seconds for a relative variance of 1."""
        return self.seconds * self.variance


@dataclass
class Row:
    """One case, renderer and number of samples."""

    case: str
    renderer: str
    setting: str
    spp: int
    pixels: Timed
    blocks: Timed
    gradient: Timed | None
    bias: float  # of the mean's block sums, noise taken out
    render: float | None = None  # seconds of a picture
    direct: float | None = None  # of a gradient of the interior and primary terms alone


@dataclass
class Report:
    """One run."""

    machine: dict[str, Any]
    rows: list[Row] = field(default_factory=list)
    missing: dict[str, list[str]] = field(default_factory=dict)  # what our plan leaves out, by case


PARTS = ("pixels", "blocks", "gradient")


def pairs(report: Report, spp: int) -> dict[str, tuple[Row, Row]]:
    """Rows of Edgegrad and Mitsuba by case."""
    rows = {(r.case, r.renderer): r for r in report.rows if r.spp == spp}
    cases = dict.fromkeys(r.case for r in report.rows)
    return {case: (rows[case, "Edgegrad"], rows[case, "Mitsuba"]) for case in cases}


def ratio(pair: tuple[Row, Row], part: str) -> float | None:
    """How much less time Edgegrad needs for the same noise; None where one of them has no such number."""
    ours, theirs = (getattr(row, part) for row in pair)
    if ours is None or theirs is None or ours.cost <= 0.0:
        return None
    return float(theirs.cost / ours.cost)


def markdown(report: Report, peer_wrong: Sequence[str], right: float) -> str:
    """The report as text."""
    about = ", ".join(f"{key} {value}" for key, value in report.machine.items())
    lines = [
        f"# Derivatives beside Mitsuba 3\n\n{about}. Seconds are medians of warm calls in turn.\n",
        "Lower by: seconds × variance of Mitsuba's / Edgegrad's, of the derivative picture by pixels and by sums over "
        "8 × 8 blocks, and of the gradient of all values. Error: of the blocks' mean against central differences, "
        "noise taken out. Backward / render: seconds of Edgegrad's gradient by those of its picture, of all terms, and "
        "of the interior and primary terms alone.\n",
    ]
    for spp in dict.fromkeys(r.spp for r in report.rows):
        lines += _table(report, spp, peer_wrong, right)
    left_out = [f"- {case}: {'; '.join(words)}" for case, words in report.missing.items() if words]
    if left_out:
        lines += ["\nWhat Edgegrad's plan says it leaves out:\n", *left_out]
    return "\n".join(lines) + "\n"


def _number(value: float | None, digits: int = 2) -> str:
    if value is None:
        return ""
    return f"{value:.{digits}g}" if value < 100 else f"{value:.0f}" if value < 1e9 else "above 10⁹"


def _table(report: Report, spp: int, peer_wrong: Sequence[str], right: float) -> list[str]:
    lines = [
        f"\n## {spp} samples per pixel\n",
        "| case | Edgegrad s forward, backward | Mitsuba s (setting) | lower by: pixels | blocks | gradient "
        "| error of Edgegrad, Mitsuba | backward / render |",
        "|---" * 8 + "|",
    ]
    counted: dict[str, dict[str, float]] = {part: {} for part in PARTS}
    backward: dict[str, float] = {}
    direct: dict[str, float] = {}
    for case, pair in pairs(report, spp).items():
        ours, theirs = pair
        wrong = case in peer_wrong or theirs.bias > right
        ratios = {part: ratio(pair, part) for part in PARTS}
        for part, value in ratios.items():
            if value is not None and not wrong and ours.bias <= right:
                counted[part][case] = value
        times = [" ".join(_number(t.seconds if t else None, 3) for t in (r.pixels, r.gradient)) for r in pair]
        if ours.gradient is not None and ours.render:
            backward[case] = ours.gradient.seconds / ours.render
        if ours.direct is not None and ours.render:
            direct[case] = ours.direct / ours.render
        cells = [f"{'(' if wrong else '**'}{_number(v)}{')' if wrong else '**'}" if v is not None else ""
                 for v in ratios.values()]
        lines.append(
            f"| {case} | {times[0]} | {times[1]} ({theirs.setting}) | {' | '.join(cells)} | {ours.bias:.3f}, "
            f"{theirs.bias:.3f} | {_number(backward.get(case))}, {_number(direct.get(case))} |"
        )
    for part, values in counted.items():
        if values:
            worst = min(values, key=lambda case: values[case])
            mean = geometric_mean(values.values())
            lines.append(f"\n{part.capitalize()}: geometric mean **{mean:.1f} ×** lower, worst {values[worst]:.2g} × "
                         f"({worst}), over the {len(values)} cases that both get right.")
    for name, pictures in (("all terms", backward), ("interior and primary", direct)):
        if pictures:
            most = max(pictures, key=lambda case: pictures[case])
            lines.append(f"\nBackward / render, {name}: geometric mean **{geometric_mean(pictures.values()):.2f}**, "
                         f"largest {pictures[most]:.2f} ({most}).")
    return lines


# Gradients of a larger relative variance aren't drawn: in glass_sphere Mitsuba's overflow.
DRAWN = 1e4


def plot(report: Report, path: Path) -> None:
    """Error of block sums against seconds of the derivative picture, and noise of the gradient, by case."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    cases = list(dict.fromkeys(r.case for r in report.rows))
    columns = min(4, len(cases))
    lines = -(-len(cases) // columns)
    figure, axes = pyplot.subplots(lines, columns, figsize=(2.7 * columns, 2.1 * lines + 0.4), squeeze=False)
    for axis in axes.flat[len(cases) :]:
        axis.set_visible(False)
    colors = {"Edgegrad": "tab:blue", "Mitsuba": "tab:orange"}
    for case, axis in zip(cases, axes.flat, strict=False):
        for renderer, color in colors.items():
            rows = [r for r in report.rows if (r.case, r.renderer) == (case, renderer)]
            axis.plot([r.blocks.seconds for r in rows], [max(r.blocks.error or 0.0, 1e-4) for r in rows], "o-",
                      color=color, markersize=3, linewidth=1.2, label=f"{renderer}: derivative picture, blocks")
            found = [(r.gradient.seconds, r.gradient.variance**0.5) for r in rows
                     if r.gradient is not None and r.gradient.variance < DRAWN]
            axis.plot(*zip(*found, strict=True) if found else ([], []), "s--", color=color, markersize=2.5,
                      linewidth=0.8, label=f"{renderer}: gradient, noise")
        axis.set_xscale("log"), axis.set_yscale("log")
        axis.set_title(case, fontsize=8)
        axis.tick_params(labelsize=6)
        axis.tick_params(which="minor", labelbottom=False, labelleft=False)
        axis.grid(alpha=0.3, linewidth=0.5)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncol=min(4, columns), fontsize=7, frameon=False)
    figure.supxlabel("seconds", fontsize=8)
    figure.supylabel("relative error", fontsize=8)
    figure.tight_layout(rect=(0.0, 0.0, 1.0, 1.0 - 0.3 / (2.1 * lines + 0.4)))
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
