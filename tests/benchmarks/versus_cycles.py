"""Edgegrad beside Cycles: the same .blend files, rendered by both, their difference beside the noise of both.

``python -m tests.benchmarks.versus_cycles`` builds each scene, saves it, opens it as a user would, renders it with
Cycles (CPU) and, through the add-on's export, with Edgegrad, and writes a table (Markdown and JSON) and pictures.
Cycles' pictures are kept in the output folder and used again while the scene's script stays the same, or builds the
same scene. ``--continued --minutes 8`` renders some of the scenes that the folder's report doesn't have yet.
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import tempfile
import time
import traceback
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad_addon.export import export_scene
from tests.benchmarks import agreement, cycles_peer, side_by_side
from tests.benchmarks.corpus import scene_contents
from tests.benchmarks.cycles_scenes import CASES, Case, stage
from tests.benchmarks.versus_mitsuba import processor

SEEDS = 6


@dataclass
class Row:
    """One scene's outcome; `figures` is None if Edgegrad could not render it, and `error` says why."""

    scene: str
    title: str
    feature: str
    bounces: int
    samples: int
    cycles_seconds: float
    edgegrad_seconds: float = 0.0
    figures: agreement.Agreement | None = None
    differs: tuple[str, ...] = ()
    notes: list[str] = field(default_factory=list)
    error: str = ""

    @property
    def speed_up(self) -> float:
        """Cycles' seconds times variance over Edgegrad's: how much sooner Edgegrad has the same noise."""
        if self.figures is None or self.figures.our_noise == 0.0:
            return float("nan")
        return self.cycles_seconds * self.figures.their_noise**2 / (self.edgegrad_seconds * self.figures.our_noise**2)

    @property
    def verdict(self) -> str:
        """"agrees"; "named" if the pictures differ for known reasons and the export says so; "differs" or "fails"."""
        if self.figures is None:
            return "fails"
        if self.figures.agrees:
            return "agrees"
        return "named" if self.differs and self.notes else "differs"


def build(case: Case, path: Path, samples: int) -> None:
    """Build a case's scene and save it."""
    stage.empty()
    case.build()  # may open a file, which replaces the scene
    cycles_peer.prepare(bpy.context.scene, samples, case.bounces, case.limits)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, check_existing=False)


def by_cycles(case: Case, output: Path, samples: int, seeds: int) -> tuple[NDArray[np.float32], float]:
    """Open the case's .blend; (seeds, H, W, 3) pictures and the median of their seconds, made or kept."""
    blend, file = output / f"{case.name}.blend", output / f"{case.name}.npz"
    key = case.fingerprint(samples, seeds, Path(cycles_peer.__file__).read_text())
    # A script doesn't give the same .blend twice (the order of a sphere's corners differs), so both are kept.
    known = cycles_peer.cached(file, blend, key) or of_same_scene(case, output, key, samples, seeds)
    if known is None:
        build(case, blend, samples)
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    if known is None:
        known = cycles_peer.render(output, seeds)
        cycles_peer.keep(file, blend, key, *known)
    return known


def of_same_scene(
    case: Case, output: Path, key: str, samples: int, seeds: int
) -> tuple[NDArray[np.float32], float] | None:
    """Pictures that were made for another script, if the script of today builds the same scene; kept for its key."""
    blend, file = output / f"{case.name}.blend", output / f"{case.name}.npz"
    known = cycles_peer.cached(file, blend)
    if known is None or len(known[0]) != seeds:
        return None
    with tempfile.TemporaryDirectory() as folder:
        rebuilt = Path(folder) / blend.name
        build(case, rebuilt, samples)
        both = []
        for one in (rebuilt, blend):
            bpy.ops.wm.open_mainfile(filepath=str(one))
            both.append(scene_contents.contents())
    if different := scene_contents.differences(*both):
        print(f"{case.name}: Cycles' picture is rendered anew, since these have changed: {', '.join(different[:5])}")
        return None
    cycles_peer.keep(file, blend, key, *known)
    return known


def by_edgegrad(samples: int, seeds: int) -> tuple[NDArray[np.float32], float, list[str]]:
    """(seeds, H, W, 3) pictures of the open scene, the median of their seconds, and what the export says of
    differences: its warnings, and its lines on settings of the scene."""
    export = export_scene(bpy.context.scene)
    renderer, limits = edgegrad.Renderer(export.scene), export.settings
    pictures, seconds = [], []
    for seed in range(seeds):
        start = time.perf_counter()
        pictures.append(renderer.render(spp=samples, seed=seed, max_depth=limits.max_depth, bounces=limits.bounces))
        seconds.append(time.perf_counter() - start)
    settings = [line for line in export.report.readings if line.startswith("scene '")]
    return np.stack(pictures), float(np.median(seconds)), export.report.lines + settings


def compare(
    case: Case, output: Path, samples: int | None = None, seeds: int = SEEDS, draft: bool = False
) -> Row:  # fmt: skip
    """Render a case with both and compare; writes its pictures. In a draft, Edgegrad takes an eighth of the samples."""
    samples = samples or case.samples
    output.mkdir(parents=True, exist_ok=True)
    theirs, cycles_seconds = by_cycles(case, output, samples, seeds)
    row = Row(case.name, case.title, case.feature, case.bounces, samples, cycles_seconds, differs=case.differs)
    try:
        effort = (samples // 4, seeds // 2) if draft else (samples, seeds)
        ours, row.edgegrad_seconds, row.notes = by_edgegrad(*effort)
        row.figures, _ = agreement.compare(ours, theirs)
    except Exception as error:  # a scene that fails is a row of the report, not its end
        row.error = f"{type(error).__name__}: {error}"
        traceback.print_exc()
        return row
    means = (x.mean(axis=0, dtype=np.float64) for x in (ours, theirs))
    side_by_side.write(output / f"{case.name}.png", *means)
    return row


HEADER = """| scene | shows | mean difference | blocks beyond 3 sigma | block RMSE (noise) | pixel RMSE (noise) | \
noise Cycles / Edgegrad | seconds Cycles / Edgegrad | same noise sooner by | outcome |
|---|---|---|---|---|---|---|---|---|---|"""


def line(row: Row) -> str:
    """A row of the table."""
    figures = row.figures
    if figures is None:
        return f"| {row.scene} | {row.title} | | | | | | {row.cycles_seconds:.1f} / | | **fails** |"
    return (f"| {row.scene} | {row.title} | {figures.mean:+.2%} ± {figures.mean_error:.2%} | {figures.beyond:.1%} | "
            f"{figures.rmse:.2%} ({figures.noise:.2%}) | {figures.pixel_rmse:.1%} ({figures.pixel_noise:.1%}) | "
            f"{figures.their_noise:.1%} / {figures.our_noise:.1%} | "
            f"{row.cycles_seconds:.2f} / {row.edgegrad_seconds:.2f} | {row.speed_up:.1f}× | "
            f"{row.verdict if row.verdict in ('agrees', 'named') else f'**{row.verdict}**'} |")


def by_feature(rows: Sequence[Row]) -> list[str]:
    """Lines of a table: how many scenes of each feature agree, differ and are named, or differ silently."""
    verdicts = ("agrees", "named", "differs", "fails")
    lines = ["| feature | scenes | agree | differ, named | differ, not named | fail |", "|---|---|---|---|---|---|"]
    features = {row.feature: [one.verdict for one in rows if one.feature == row.feature] for row in rows}
    for feature, found in (*features.items(), ("**all**", [row.verdict for row in rows])):
        counts = [str(found.count(verdict)) if found.count(verdict) else "" for verdict in verdicts]
        lines.append(f"| {feature} | {len(found)} | {' | '.join(counts)} |")
    return lines


def markdown(rows: Sequence[Row], machine: dict[str, Any]) -> str:
    """The report as text."""
    about = ", ".join(f"{key} {value}" for key, value in machine.items())
    agreeing = sum(row.verdict == "agrees" for row in rows)
    lines = [
        "# Edgegrad beside Cycles\n",
        f"{about}. {agreeing} of {len(rows)} scenes agree.\n",
        f"Mean difference: (Edgegrad - Cycles) / Cycles, with its standard error. A picture agrees if that is within "
        f"{agreement.MEAN_LIMIT:.0%} and at most {agreement.BEYOND_LIMIT:.0%} of its blocks of {agreement.BLOCK} x "
        f"{agreement.BLOCK} pixels are beyond three standard errors (0.3 % are by chance), or their difference beyond "
        f"the noise is at most {agreement.EXCESS_LIMIT:.0%} of the picture's mean. RMSE relative to the mean, in "
        "brackets what the noise alone would give. Noise and seconds are of one picture of one seed (Cycles' are kept "
        "with its pictures); their last column is the quotient of seconds times variance.\n",
        *by_feature(rows),
        "",
        HEADER,
        *map(line, rows),
        "\n## Known differences\n",
    ]
    lines += [f"- **{row.scene}**: {reason}" for row in rows for reason in row.differs] or ["none"]
    lines.append("\n## What the export reported\n")
    lines += [f"- **{row.scene}**: {note}" for row in rows for note in row.notes] or ["nothing"]
    if failed := [row for row in rows if row.error]:
        lines.append("\n## Failures\n")
        lines += [f"- **{row.scene}**: {row.error}" for row in failed]
    return "\n".join(lines) + "\n"


def read_rows(report: Path) -> dict[str, Row]:
    """The rows of a report that was written as JSON, by their scenes; none if there is no file."""
    if not report.is_file():
        return {}
    names = {one.name for one in fields(Row)}
    stored = json.loads(report.read_text())["rows"]
    rows = [{key: value for key, value in row.items() if key in names} for row in stored]
    for row in rows:
        row["figures"] = row["figures"] and agreement.Agreement(**row["figures"])
        row["differs"] = tuple(row["differs"])
    return {row["scene"]: Row(**row) for row in rows}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help=f"some of {', '.join(CASES)} (default: all)")
    parser.add_argument("--output", type=Path, default=Path("build/compare-cycles"), help="folder of the report")
    parser.add_argument("--samples", type=int, help="samples per pixel and seed (default: each scene's own)")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--draft", action="store_true", help="Edgegrad takes an eighth of Cycles' samples")
    parser.add_argument("--continued", action="store_true", help="keep the scenes of the folder's report")
    parser.add_argument("--minutes", type=float, default=math.inf, help="start no scene after these")
    arguments = parser.parse_args()
    if unknown := [name for name in arguments.scenes if name not in CASES]:
        parser.error(f"unknown scene {unknown[0]}; there are {', '.join(CASES)}")
    start = time.perf_counter()
    output = arguments.output.resolve()  # Blender's paths must not be relative
    kept = read_rows(output / "versus_cycles.json") if arguments.continued else {}
    for name in arguments.scenes or [name for name in CASES if name not in kept]:
        if time.perf_counter() - start > 60.0 * arguments.minutes:
            break
        kept[name] = compare(CASES[name], output, arguments.samples, arguments.seeds, arguments.draft)
        print(line(kept[name]), kept[name].error, flush=True)
    rows = [kept[name] for name in CASES if name in kept]
    machine = {"Blender": bpy.app.version_string, "processor": processor(), "Python": platform.python_version(),
               "seeds": arguments.seeds, "draft": arguments.draft,
               "minutes": round((time.perf_counter() - start) / 60.0, 1)}  # fmt: skip
    text = markdown(rows, machine)
    print(text)
    (output / "versus_cycles.md").write_text(text)
    derived = [{"verdict": row.verdict, "speed_up": row.speed_up} for row in rows]
    report = {"machine": machine, "rows": [asdict(row) | more for row, more in zip(rows, derived, strict=True)]}
    (output / "versus_cycles.json").write_text(json.dumps(report, indent=1))


if __name__ == "__main__":
    main()
