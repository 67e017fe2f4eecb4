"""``blender --background file.blend --command edgegrad …`` and ``python -m edgegrad … file.blend``.

Nothing is written into the .blend that was read, unless --save names it. Exit codes: 0 done, 1 a failure, said in one
sentence, 2 wrong arguments, 130 interrupted.
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

import edgegrad
from edgegrad import images
from edgegrad.progress import ProgressBar

from .derivative import DIRECTIONS, derivative_picture
from .export import export_scene, render_export
from .parameters import Names
from .problem import Problem, Report
from .session import Picture, Request, Session, find_camera

SPP_OF_PICTURES = 64  # samples per pixel of the pictures that are written before and after a fit


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code.

    Parameters
    ----------
    argv
        Arguments without the program's name; None: those of the process.
    """
    try:
        arguments = _parser().parse_args(sys.argv[1:] if argv is None else list(argv))
    except SystemExit as end:  # argparse has said why
        return end.code if isinstance(end.code, int) else 2
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            _open(arguments.blend)
            arguments.run(arguments)
    except KeyboardInterrupt:
        print("edgegrad: interrupted; nothing was changed", file=sys.stderr)
        return 130
    except (Problem, ValueError, OSError, RuntimeError, FloatingPointError, ImportError) as error:
        print(f"edgegrad: error: {str(error).strip()}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="edgegrad", description="Fit a Blender scene to pictures.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    fit = commands.add_parser("fit", help="move parameters until the cameras see their targets")
    _common(fit, 16)
    _parameters(fit)
    fit.add_argument("--target", action="append", required=True, metavar="CAMERA=FILE", help="picture of a camera")
    fit.add_argument("--mask", action="append", default=[], metavar="CAMERA=FILE", help="black pixels are ignored")
    fit.add_argument("--iterations", type=_positive, default=200)
    fit.add_argument("--views-per-iteration", type=_positive, metavar="N", help="pictures per step (default: all)")
    fit.add_argument("--smoothness", type=float, help="how far neighbouring vertices move along (default: by count)")
    fit.add_argument("--vertex-step", type=float, metavar="F", help="first step, as a fraction of the object's size")
    fit.add_argument("--slide", type=float, metavar="F", help="share of the motion along the surface that is kept")
    fit.add_argument("--out", type=Path, metavar="DIR", help="folder for pictures before and after, and report.json")
    fit.add_argument("--save", type=Path, metavar="BLEND", help="write the fitted scene into this file")
    where = fit.add_mutually_exclusive_group()
    where.add_argument("--shape-key", action="store_true", help="write vertices as a new shape key (default)")
    where.add_argument("--in-place", action="store_true", help="write vertices into the mesh itself")
    fit.set_defaults(run=_fit)

    render = commands.add_parser("render", help="render a camera's picture")
    _common(render, 64)
    render.add_argument("--camera", help="name of the camera (default: the active one)")
    render.add_argument("--out", type=Path, required=True, metavar="FILE", help=".exr or .png")
    render.set_defaults(run=_render)

    gradient = commands.add_parser("gradient", help="how a camera's picture changes with a parameter")
    _common(gradient, 64)
    _parameters(gradient)
    gradient.add_argument("--direction", choices=[d.lower() for d in DIRECTIONS], default="normal",
                          help="where vertices move (default: normal)")  # fmt: skip
    gradient.add_argument("--camera", help="name of the camera (default: the active one)")
    gradient.add_argument("--out", type=Path, required=True, metavar="FILE",
                          help=".exr for the values, .png for a picture (red brighter, blue darker)")  # fmt: skip
    gradient.set_defaults(run=_gradient)
    return parser


def _common(parser: argparse.ArgumentParser, samples: int) -> None:
    parser.add_argument("blend", nargs="?", help="the .blend to open (default: the one that is open)")
    parser.add_argument("--samples", type=_positive, default=samples, help=f"per pixel (default: {samples})")
    parser.add_argument("--seed", type=int, default=0)


def _parameters(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--vertices", action="append", default=[], metavar="OBJECT")
    parser.add_argument("--base-color", action="append", default=[], metavar="MATERIAL")
    parser.add_argument("--emission", action="append", default=[], metavar="MATERIAL")
    parser.add_argument("--power", action="append", default=[], metavar="LIGHT", help="a light's power or strength")


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be 1 or more, not {value}")
    return value


def _names(arguments: argparse.Namespace) -> Names:
    return Names(tuple(arguments.vertices), tuple(arguments.base_color), tuple(arguments.emission),
                 tuple(arguments.power))  # fmt: skip


def _open(blend: str | None) -> None:
    """Open the file, unless it is open already."""
    if blend is None:
        return
    path = Path(blend).resolve()
    if bpy.data.filepath and Path(bpy.data.filepath).resolve() == path:
        return
    if not path.is_file():
        raise Problem(f"file '{blend}': there is no such file")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    except RuntimeError as error:
        raise Problem(f"file '{blend}': can't be opened ({str(error).strip()})") from None


def _by_camera(option: str, texts: Sequence[str]) -> dict[str, str]:
    out: dict[str, str] = {}
    for text in texts:
        camera, equals, path = text.partition("=")
        if not equals or not camera or not path:
            raise Problem(f"{option} '{text}': must have the form CAMERA=FILE")
        if camera in out:
            raise Problem(f"{option} '{text}': camera '{camera}' has one already")
        out[camera] = path
    return out


def _request(arguments: argparse.Namespace) -> Request:
    masks = _by_camera("--mask", arguments.mask)
    targets = _by_camera("--target", arguments.target)
    for camera in masks:
        if camera not in targets:
            raise Problem(f"--mask '{camera}={masks[camera]}': camera '{camera}' has no --target")
    return Request(
        pictures=[Picture(camera, path, masks.get(camera, "")) for camera, path in targets.items()],
        names=_names(arguments),
        iterations=arguments.iterations,
        samples=arguments.samples,
        seed=arguments.seed,
        smoothness=arguments.smoothness,
        vertex_step=arguments.vertex_step,
        slide=arguments.slide,
        views_per_iteration=arguments.views_per_iteration,
        in_place=arguments.in_place,
    )


def _fit(arguments: argparse.Namespace) -> None:
    request = _request(arguments)
    _check_can_write(arguments.save)
    session = Session.prepare(bpy.context, request)
    _print_warnings(session.export.report)
    _print_notes(session.notes)
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
        _write_pictures(session, arguments.out, "before")
    with ProgressBar("fit") as bar:
        note = ""

        def tell(step: Any) -> None:
            nonlocal note
            note = f"{step.iteration} / {step.iterations}   loss {step.smoothed:.4g}"

        result = session.run(callback=tell, progress=_shown(bar, lambda: note))
    session.write(result)
    _print_notes([note for note in result.notes if note not in session.notes])
    if arguments.out is not None:
        _write_pictures(session, arguments.out, "after")
        _write_report(session, result, arguments.out / "report.json")
    if arguments.save is not None:
        bpy.ops.wm.save_as_mainfile(filepath=str(arguments.save.resolve()), copy=True)
    print(f"edgegrad: loss {result.losses[0]:.5g} -> {result.losses[result.best]:.5g} in {result.seconds:.1f} s")


def _render(arguments: argparse.Namespace) -> None:
    _check_can_write(arguments.out)
    export = export_scene(bpy.context.scene, bpy.context.evaluated_depsgraph_get(), _camera(arguments.camera))
    _print_warnings(export.report)
    with ProgressBar("render") as bar:
        picture = render_export(export.scene, export.settings, arguments.samples, arguments.seed, _shown(bar))
    images.write_image(arguments.out, picture)


def _gradient(arguments: argparse.Namespace) -> None:
    _check_can_write(arguments.out)
    with ProgressBar("gradient") as bar:
        picture, export, notes = derivative_picture(
            bpy.context, _names(arguments), arguments.direction.upper(), arguments.samples,
            _camera(arguments.camera), arguments.seed, _shown(bar),
        )  # fmt: skip
    _print_warnings(export.report)
    _print_notes(notes)
    if arguments.out.suffix.lower() == ".png":
        images.write_derivative(arguments.out, picture)
    else:
        images.write_image(arguments.out, picture)


def _shown(bar: ProgressBar, note: Callable[[], str] = str) -> Callable[[float], None]:
    """Progress for the bar."""
    return lambda fraction: bar.update(fraction, note())


def _camera(name: str | None) -> Any:
    return None if name is None else find_camera(bpy.context.scene, name)


def _check_can_write(path: Path | None) -> None:
    """Before the work, not after it."""
    if path is not None and not path.resolve().parent.is_dir():
        raise Problem(f"file '{path}': its folder doesn't exist")


def _write_pictures(session: Session, folder: Path, prefix: str) -> None:
    renderer, limits = edgegrad.Renderer(session.export.scene), session.export.settings
    for picture, target in zip(session.request.pictures, session.targets, strict=True):
        pixels = renderer.render(spp=SPP_OF_PICTURES, max_depth=limits.max_depth, bounces=limits.bounces,
                                 camera=target.camera)  # fmt: skip
        name = f"{prefix}_{bpy.path.clean_name(picture.camera)}"
        images.write_image(folder / f"{name}.exr", pixels)
        images.write_image(folder / f"{name}.png", pixels)


def _write_report(session: Session, result: Any, path: Path) -> None:
    values = {name: np.asarray(value).tolist() for name, value in result.values.items() if np.size(value) <= 3}
    report = {
        "losses": result.losses,
        "best": result.best,
        "seconds": result.seconds,
        "values": values,
        "untouched": result.untouched,
        "warnings": session.export.report.lines,
        "notes": result.notes,
    }
    path.write_text(json.dumps(report, indent=1) + "\n")


def _print_warnings(report: Report) -> None:
    for line in report.lines:
        print(f"edgegrad: warning: {line}", file=sys.stderr)


def _print_notes(notes: Sequence[str]) -> None:
    for note in notes:
        print(f"edgegrad: note: {note}", file=sys.stderr)


def _show_warning(message: Warning | str, category: type[Warning], filename: str, lineno: int, file: Any = None,
                  line: str | None = None) -> None:  # fmt: skip
    print(f"edgegrad: warning: {message}", file=sys.stderr)
