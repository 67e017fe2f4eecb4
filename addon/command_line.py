"""``blender --background file.blend --command edgegrad …`` and ``python -m edgegrad … file.blend``.

The .blend that is read stays unchanged, unless --save names it. Exit codes: 0 success; 1 failure, described in one
sentence; 2 wrong arguments; 130 interrupted.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

import bpy

from edgegrad import images
from edgegrad.images.output_files import check_outputs
from edgegrad.progress import ProgressBar

from .animated.driver import Driver
from .animated.parameter import Wanted
from .animated.stored import stored_wanted, wanted_of
from .blend_file import open_blend
from .export import export_scene, render_export
from .fit_output import FitOutput
from .look.check import compare
from .look.derivative import DIRECTIONS, derivative_picture
from .parameters import Names
from .problem import Problem
from .session import Picture, Request, Session, camera_names, find_camera
from .view_transforms import AUTO


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code.

    Parameters
    ----------
    argv
        Arguments without the name of the program; None: those of the process.
    """
    try:
        arguments = _parser().parse_args(sys.argv[1:] if argv is None else list(argv))
    except SystemExit as end:  # argparse has printed the reason
        return end.code if isinstance(end.code, int) else 2
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            failures = arguments.run(arguments)
    except KeyboardInterrupt as interrupt:
        _say(f"interrupted; {str(interrupt) or 'nothing was changed'}")
        return 130
    except (Problem, ValueError, OSError, RuntimeError, FloatingPointError, ImportError) as error:
        failures = [str(error).strip()]
    for failure in failures:
        _say(f"error: {failure}")
    return 1 if failures else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="edgegrad", description="Fit a Blender scene to pictures.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    fit = commands.add_parser("fit", help="change parameters until the cameras' pictures match their targets")
    _common(fit, 16)
    _parameters(fit)
    _animated(fit)
    fit.add_argument("--target", action="append", required=True, metavar="CAMERA=FILE",
                     help="target picture of a camera (the name may contain =; the longest match is used)")  # fmt: skip
    fit.add_argument("--mask", action="append", default=[], metavar="CAMERA=FILE",
                     help="mask of a camera's target: black pixels are ignored")  # fmt: skip
    fit.add_argument("--view", action="append", default=[], metavar="[CAMERA=]VIEW",
                     help="view transform of the targets, or of one: auto (default), scene, sRGB, Standard, AgX, "
                     "Filmic or another of Blender's")  # fmt: skip
    fit.add_argument("--iterations", type=_positive, default=200)
    fit.add_argument("--views-per-iteration", type=_positive, metavar="N", help="pictures per iteration (default: all)")
    fit.add_argument("--smoothness", type=float,
                     help="how strongly neighbouring vertices move together (default: by number)")  # fmt: skip
    fit.add_argument("--vertex-step", type=float, metavar="F",
                     help="first step of vertices, as a fraction of the object's size")  # fmt: skip
    fit.add_argument("--slide", type=float, metavar="F",
                     help="factor in [0, 1] for the motion of vertices along the surface")  # fmt: skip
    fit.add_argument("--out", type=Path, metavar="DIR",
                     help="folder for pictures before and after the fit, and report.json")  # fmt: skip
    fit.add_argument("--save", type=Path, metavar="BLEND", help="save the fitted scene as this .blend")
    where = fit.add_mutually_exclusive_group()
    where.add_argument("--shape-key", action="store_true", help="write vertices into a new shape key (default)")
    where.add_argument("--in-place", action="store_true", help="write vertices into the mesh itself")
    fit.set_defaults(run=_fit)

    render = commands.add_parser("render", help="render a camera's picture")
    _common(render, 64)
    render.add_argument("--camera", help="name of the camera (default: the active one)")
    render.add_argument("--out", type=Path, required=True, metavar="FILE", help=".exr or .png")
    render.set_defaults(run=_render)

    check = commands.add_parser("check", help="compare derivatives by properties with differences of the picture")
    _common(check, 64)
    _animated(check)
    check.add_argument("--camera", help="name of the camera (default: the active one)")
    check.set_defaults(run=_check)

    gradient = commands.add_parser("gradient", help="derivative of a camera's picture with respect to a parameter")
    _common(gradient, 64)
    _parameters(gradient)
    gradient.add_argument("--direction", choices=[d.lower() for d in DIRECTIONS], default="normal",
                          help="direction in which vertices move (default: normal)")  # fmt: skip
    gradient.add_argument("--camera", help="name of the camera (default: the active one)")
    gradient.add_argument("--out", type=Path, required=True, metavar="FILE",
                          help=".exr for the values, .png for a picture (red brighter, blue darker)")  # fmt: skip
    gradient.set_defaults(run=_gradient)
    return parser


def _common(parser: argparse.ArgumentParser, samples: int) -> None:
    parser.add_argument("blend", nargs="?", help="the .blend to open (default: the open file)")
    parser.add_argument("--samples", type=_positive, default=samples, help=f"samples per pixel (default: {samples})")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--allow-scripts", action="store_true",
                        help="run Python scripts in the .blend: drivers and registered texts (default: off; a file "
                        "that Blender opens before --command follows Blender's --enable-autoexec)")  # fmt: skip



def _parameters(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--vertices", action="append", default=[], metavar="OBJECT")
    parser.add_argument("--base-color", action="append", default=[], metavar="MATERIAL")
    parser.add_argument("--emission", action="append", default=[], metavar="MATERIAL")
    parser.add_argument("--power", action="append", default=[], metavar="LIGHT", help="power or strength of a light")


def _animated(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--parameter", action="append", default=[], metavar="PATH",
                        help="any animatable property, by its full data path, such as 'objects[\"Cube\"].location'; "
                        "with limits: 'PATH in LOW:HIGH' (default: the list that is stored in the .blend)")  # fmt: skip
    parser.add_argument("--all-of", action="append", default=[], metavar="PATH",
                        help="all properties of an object, its data, a material, a world or a bone with those below "
                        "it, such as 'objects[\"Rig\"].pose.bones[\"Arm\"]'")  # fmt: skip


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be 1 or more, not {value}")
    return value


def _names(arguments: argparse.Namespace) -> Names:
    return Names(tuple(arguments.vertices), tuple(arguments.base_color), tuple(arguments.emission),
                 tuple(arguments.power))  # fmt: skip


def _wanted(arguments: argparse.Namespace) -> tuple[Wanted, ...]:
    """Properties of the arguments; without any parameter there, those that the .blend has stored."""
    out = [Wanted.parse(text) for text in arguments.parameter]
    for text in arguments.all_of:
        found, notes = wanted_of(text)
        out += [one for one in found if one.path not in {other.path for other in out}]
        _print_notes([f"left out: {note}" for note in notes])
    given = out or any(getattr(arguments, name, ()) for name in ("vertices", "base_color", "emission", "power"))
    return tuple(out if given else stored_wanted(bpy.context.scene))


def _open(arguments: argparse.Namespace) -> None:
    warning = open_blend(arguments.blend, arguments.allow_scripts)
    if warning is not None:
        _print_warnings([warning])


def _by_camera(option: str, texts: Sequence[str], what: str = "FILE") -> dict[str, str]:
    cameras = sorted(camera_names(bpy.context.scene), key=len, reverse=True)
    out: dict[str, str] = {}
    for text in texts:
        # Names of cameras and of files may contain "=".
        named = next((name for name in cameras if text.startswith(f"{name}=")), text.partition("=")[0])
        camera, path = named, text[len(named) + 1 :]
        if not camera or not path:
            raise Problem(f"{option} '{text}': must have the form CAMERA={what}")
        if camera in out:
            raise Problem(f"{option} '{text}': camera '{camera}' already has a {option.removeprefix('--')}")
        out[camera] = path
    return out


def _views(texts: Sequence[str], targets: Mapping[str, str]) -> dict[str, str]:
    """Return the view transform of each target; one without a camera is that of all others."""
    general = [text for text in texts if "=" not in text]
    if len(general) > 1:
        raise Problem(f"--view '{general[1]}': --view '{general[0]}' is given too; name a camera, as CAMERA=VIEW")
    own = _by_camera("--view", [text for text in texts if "=" in text], "VIEW")
    for camera, view in own.items():
        if camera not in targets:
            raise Problem(f"--view '{camera}={view}': camera '{camera}' has no --target")
    return {camera: own.get(camera, general[0] if general else AUTO) for camera in targets}


def _request(arguments: argparse.Namespace) -> Request:
    masks = _by_camera("--mask", arguments.mask)
    targets = _by_camera("--target", arguments.target)
    for camera in masks:
        if camera not in targets:
            raise Problem(f"--mask '{camera}={masks[camera]}': camera '{camera}' has no --target")
    views = _views(arguments.view, targets)
    return Request(
        pictures=[Picture(camera, path, masks.get(camera, ""), views[camera]) for camera, path in targets.items()],
        names=_names(arguments),
        iterations=arguments.iterations,
        samples=arguments.samples,
        seed=arguments.seed,
        smoothness=arguments.smoothness,
        vertex_step=arguments.vertex_step,
        slide=arguments.slide,
        views_per_iteration=arguments.views_per_iteration,
        in_place=arguments.in_place,
        animated=_wanted(arguments),
    )


def _fit(arguments: argparse.Namespace) -> list[str]:
    output = FitOutput(arguments.out, arguments.save)
    output.check()
    _open(arguments)
    session = Session.prepare(bpy.context, _request(arguments))
    output.prepare(session)
    _print_warnings(session.export.report.lines)
    _print_notes(session.notes)
    if arguments.save is None:
        _print_notes(["the fitted scene will not be saved; --save BLEND saves it as a file"])
    output.write_before(session)
    with ProgressBar("fit") as bar:
        note = ""

        def tell(step: Any) -> None:
            nonlocal note
            note = f"{step.iteration} / {step.iterations}   loss {step.smoothed:.4g}"

        result = session.run(callback=tell, progress=_shown(bar, lambda: note))
    session.write(result)
    failures = output.write(session, result)
    _print_notes([*(note for note in result.notes if note not in session.notes), *session.late_notes])
    where = f", saved as '{arguments.save}'" if arguments.save in output.written else ""
    losses = f"{result.losses[0]:.5g} -> {result.losses[result.best]:.5g}"
    _say(f"loss {losses} in {result.seconds:.1f} s{where}", sys.stdout)
    return failures


def _render(arguments: argparse.Namespace) -> list[str]:
    check_outputs([arguments.out], images.WRITABLE)
    _open(arguments)
    camera = _camera(arguments.camera)
    export = export_scene(bpy.context.scene, () if camera is None else (camera,))
    _print_warnings(export.report.lines)
    with ProgressBar("render") as bar:
        picture = render_export(export.scene, export.settings, arguments.samples, arguments.seed, _shown(bar))
    images.write_image(arguments.out, picture)
    return []


def _check(arguments: argparse.Namespace) -> list[str]:
    _open(arguments)
    wanted = _wanted(arguments)
    if not wanted:
        raise Problem("no property is given; name one by --parameter, or store a list in the .blend")
    camera = _camera(arguments.camera) or bpy.context.scene.camera
    if camera is None:
        raise Problem(f"scene '{bpy.context.scene.name}': has no camera; add one, or name it by --camera")
    driver = Driver(bpy.context.scene, [camera], wanted)
    _print_notes(driver.notes)
    wrong = 0
    for found in compare(driver, arguments.samples, arguments.seed):
        _say(str(found), sys.stdout)
        wrong += not found.agrees
    return [f"{wrong} derivatives differ from finite differences of the picture"] if wrong else []


def _gradient(arguments: argparse.Namespace) -> list[str]:
    check_outputs([arguments.out], images.WRITABLE)
    _open(arguments)
    with ProgressBar("gradient") as bar:
        picture, export, notes = derivative_picture(
            bpy.context, _names(arguments), arguments.direction.upper(), arguments.samples,
            _camera(arguments.camera), arguments.seed, _shown(bar),
        )  # fmt: skip
    _print_warnings(export.report.lines)
    _print_notes(notes)
    if arguments.out.suffix.lower() == ".png":
        images.write_derivative(arguments.out, picture)
    else:
        images.write_image(arguments.out, picture)
    return []


def _shown(bar: ProgressBar, note: Callable[[], str] = str) -> Callable[[float], None]:
    """Make a progress function that updates the bar."""
    return lambda fraction: bar.update(fraction, note())


def _camera(name: str | None) -> Any:
    return None if name is None else find_camera(bpy.context.scene, name)


def _print_warnings(lines: Sequence[str]) -> None:
    for line in lines:
        _say(f"warning: {line}")


def _print_notes(notes: Sequence[str]) -> None:
    for note in notes:
        _say(f"note: {note}")


def _show_warning(message: Warning | str, category: type[Warning], filename: str, lineno: int, file: Any = None,
                  line: str | None = None) -> None:  # fmt: skip
    _say(f"warning: {message}")


def _say(text: str, stream: TextIO | None = None) -> None:
    """Print to stderr, or to `stream`; a closed pipe or a full disk must not stop the work."""
    with contextlib.suppress(OSError, ValueError):
        print(f"edgegrad: {text}", file=stream or sys.stderr, flush=True)
