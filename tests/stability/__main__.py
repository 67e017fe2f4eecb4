"""``python -m tests.stability``: how errors of derivatives grow as scenes get hard, as a table and a plot."""

from __future__ import annotations

import argparse
import pathlib

from tests.stability.stresses import STRESSES, Error, Stress

PLOT = pathlib.Path(__file__).parent / "error_growth.png"


def row(stress: Stress, errors: list[Error]) -> str:
    """A row of the table."""
    first, last = stress.values[0], stress.values[-1]
    worst = max(range(len(errors)), key=lambda k: errors[k][0])
    error, noise = errors[worst]
    spread = f" ± {noise:.0e}" if noise else ""
    return (f"| {stress.name} | {first:.3g} … {last:.3g} {stress.unit} | {errors[0][0]:.0e} | {errors[-1][0]:.0e} "
            f"| {error:.0e}{spread} at {stress.values[worst]:.3g} | {stress.truth} |")


def plot(measured: dict[str, list[Error]], path: pathlib.Path) -> None:
    """One small panel for each family: error over the step from harmless to hard, noise as bars."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    columns = 5
    rows = -(-len(measured) // columns)
    figure, axes = pyplot.subplots(rows, columns, figsize=(3.0 * columns, 2.4 * rows), sharey=True, squeeze=False)
    for axis in axes.flat[len(measured) :]:
        axis.set_axis_off()
    for axis, stress in zip(axes.flat, (s for s in STRESSES if s.name in measured), strict=False):
        errors, noise = zip(*measured[stress.name], strict=True)
        places = list(range(len(errors)))
        axis.errorbar(places, [max(e, 1e-8) for e in errors], noise, marker="o", capsize=2)
        axis.set_yscale("log")
        axis.set_ylim(1e-8, 1.0)
        labels = [places[0], places[len(places) // 2], places[-1]]
        axis.set_xticks(labels, [f"{stress.values[k]:.2g}" for k in labels])
        axis.set_title(stress.name, fontsize=9)
        axis.set_xlabel(stress.unit, fontsize=8)
        axis.grid(alpha=0.3)
    for axis in axes[:, 0]:
        axis.set_ylabel("relative error", fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plot", type=pathlib.Path, default=PLOT, help="PNG to write")
    parser.add_argument("--only", default="", help="families whose name contains this")
    arguments = parser.parse_args()
    print("| stress | from … to | error at first | at last | largest | compared with |")
    print("|---|---|---|---|---|---|", flush=True)
    measured = {}
    for stress in STRESSES:
        if arguments.only in stress.name:
            measured[stress.name] = [stress.error(value) for value in stress.values]
            print(row(stress, measured[stress.name]), flush=True)
    plot(measured, arguments.plot)


if __name__ == "__main__":
    main()
