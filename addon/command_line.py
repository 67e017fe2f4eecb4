"""``blender --background file.blend --command edgegrad …`` and ``python -m edgegrad … file.blend``.

The .blend that is read stays unchanged, unless --save names it. Exit codes: 0 success; 1 failure, described in one
sentence, or a result of which a part was not written; 2 wrong arguments or set-up; 130 interrupted.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

import bpy

from edgegrad import FitStep, images, losses
from edgegrad.fitting.checkpoints.checkpoint_file import check_checkpoint
from edgegrad.images.output_files import check_outputs
from edgegrad.progress import ProgressBar

from . import vertex_options
from .animated.driver import Driver
from .animated.parameter import Wanted
from .animated.stored import stored_wanted, wanted_of
from .blend_file import open_blend
from .export import export_scene, render_export
from .field_fit import options as field_options
from .field_fit.options import whole
from .fit_output import FitOutput
from .fit_setup import add_beginning, beginning, stored_request, stored_settings, with_setup
from .json_lines import write_line
from .look.check import compare
from .look.derivative import DIRECTIONS, derivative_picture
from .parameters import Names
from .problem import Problem
from .session import Request, Session, find_camera
from .targets.film import FrameRange
from .targets.options import add_arguments, has_targets, pictures

REQUEST_FIELDS = ("iterations", "samples", "smoothness", "vertex_step", "slide", "views_per_iteration", "loss")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code.

    Parameters
    ----------
    argv
        Arguments without the name of the program; None: those of the process.
    """
    given = sys.argv[1:] if argv is None else list(argv)
    try:
        parser = _parser()
        arguments = parser.parse_args(given)
        setup = getattr(arguments, "setup", None)
        if setup is not None:
            own = arguments.parser
            arguments = parser.parse_args([given[0], *with_setup(own, given[1:], setup)])
        if arguments.run is _fit and arguments.save is None and arguments.out is None:
            arguments.parser.error("the result would be lost: give --save BLEND, --out DIR, or both")
    except SystemExit as end:  # argparse has printed the reason
        return end.code if isinstance(end.code, int) else 2
    except Problem as problem:
        _say(f"error: {problem}")
        return 2
    as_json = getattr(arguments, "json_progress", False)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            failures = arguments.run(arguments)
    except KeyboardInterrupt as interrupt:
        said = f"interrupted; {str(interrupt) or 'nothing was changed'}"
        _say(said)
        if as_json:
            write_line("error", message=said)
        return 130
    except (Problem, ValueError, OSError, RuntimeError, FloatingPointError, ImportError) as error:
        failures = [str(error).strip()]
    for failure in failures:
        _say(f"error: {failure}")
        if as_json:
            write_line("error", message=failure)
    return 1 if failures else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="edgegrad", description="Fit a Blender scene to pictures.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    fit = commands.add_parser("fit", help="change parameters until the cameras' pictures match their targets")
    _common(fit, 16, None)
    _parameters(fit)
    _animated(fit)
    add_arguments(fit)
    fit.add_argument("--setup", type=Path, metavar="FILE.json",
                     help="options by name; those of the command line come first")  # fmt: skip
    fit.add_argument("--frames", type=_frames, metavar="FIRST:LAST[:STEP]", help="fit a film: targets "
                     "are movies or numbered files (film.%%04d.png), keyed properties get a key at each frame, all "
                     "other parameters one value")  # fmt: skip
    fit.add_argument("--keyed", action="append", default=[], metavar="PATH", help="as --parameter, for a property that "
                     "has no keyframes yet and should get one at each of the --frames")  # fmt: skip
    fit.add_argument("--frame-smoothness", type=float, metavar="W", help="weight of the prior of smooth motion over "
                     "the --frames; 0: none (default: 0.001)")  # fmt: skip
    fit.add_argument("--first-every", type=whole(1), metavar="N", help="fit every n-th of the --frames first "
                     "(default: 8)")  # fmt: skip
    fit.add_argument("--loss", choices=list(losses.NAMED),
                     help="how pictures are compared with their targets (default: pyramid)")  # fmt: skip
    fit.add_argument("--iterations", type=whole(1), help="steps (default: 200)")
    fit.add_argument("--views-per-iteration", type=whole(1), metavar="N", help="pictures per iteration (default: all)")
    add_beginning(fit)
    fit.add_argument("--smoothness", type=float,
                     help="how strongly neighbouring vertices move together (default: by number)")  # fmt: skip
    fit.add_argument("--vertex-step", type=float, metavar="F",
                     help="first step of vertices, as a fraction of the object's size")  # fmt: skip
    vertex_options.add_arguments(fit)
    fit.add_argument("--slide", type=float, metavar="F",
                     help="factor in [0, 1] for the motion of vertices along the surface")  # fmt: skip
    field_options.add_arguments(fit)
    fit.add_argument("--out", type=Path, metavar="DIR",
                     help="folder for pictures before and after the fit, and report.json")  # fmt: skip
    fit.add_argument("--save", type=Path, metavar="BLEND", help="save the fitted scene as this .blend")
    fit.add_argument("--checkpoint", type=Path, metavar="FILE.npz", help="keep the state of the fit in this file")
    fit.add_argument("--checkpoint-every", type=whole(1), default=25, metavar="N",
                     help="iterations between checkpoints (default: 25)")  # fmt: skip
    fit.add_argument("--resume", action="store_true", help="go on from --checkpoint, if there is one")
    fit.add_argument("--json-progress", action="store_true", help="print progress to stdout as lines of JSON")
    where = fit.add_mutually_exclusive_group()
    where.add_argument("--shape-key", action="store_true", help="write vertices into a new shape key (default)")
    where.add_argument("--in-place", action="store_true", help="write vertices into the mesh itself")
    fit.set_defaults(run=_fit, parser=fit)

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


def _common(parser: argparse.ArgumentParser, samples: int, default: int | None = 64) -> None:
    parser.add_argument("blend", nargs="?", help="the .blend to open (default: the open file)")
    parser.add_argument("--samples", type=whole(1), default=default, help=f"samples per pixel (default: {samples})")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--allow-scripts", "--enable-autoexec", action="store_true",
                        help="run Python scripts in the .blend: drivers and registered texts (default: off; a file "
                        "that Blender opens before --command follows Blender's --enable-autoexec)")  # fmt: skip


def _parameters(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--vertices", action="append", default=[], metavar="OBJECT")
    parser.add_argument("--base-color", action="append", default=[], metavar="MATERIAL")
    parser.add_argument("--emission", action="append", default=[], metavar="MATERIAL")
    parser.add_argument("--power", action="append", default=[], metavar="LIGHT", help="power or strength of a light")
    parser.add_argument("--image", action="append", default=[], metavar="IMAGE", help="all pixels of an image")


def _animated(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--parameter", action="append", default=[], metavar="PATH",
                        help="any animatable property, by its full data path, such as 'objects[\"Cube\"].location'; "
                        "with limits: 'PATH in LOW:HIGH' (default: the list that is stored in the .blend)")  # fmt: skip
    parser.add_argument("--all-of", action="append", default=[], metavar="PATH",
                        help="all properties of an object, its data, a material, a world or a bone with those below "
                        "it, such as 'objects[\"Rig\"].pose.bones[\"Arm\"]'")  # fmt: skip


def _frames(text: str) -> FrameRange:
    try:
        return FrameRange.parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _names(arguments: argparse.Namespace) -> Names:
    return Names(tuple(arguments.vertices), tuple(arguments.base_color), tuple(arguments.emission),
                 tuple(arguments.power), tuple(arguments.image))  # fmt: skip


def _wanted(arguments: argparse.Namespace) -> tuple[Wanted, ...]:
    """Properties of the arguments; without any parameter there, those that the .blend has stored."""
    out = [Wanted.parse(text) for text in arguments.parameter]
    out += [Wanted.parse(text, keyed=True) for text in getattr(arguments, "keyed", [])]
    for text in arguments.all_of:
        found, notes = wanted_of(text)
        out += [one for one in found if one.path not in {other.path for other in out}]
        _print_notes([f"left out: {note}" for note in notes])
    others = ("field", "vertices", "base_color", "emission", "power", "image")
    given = out or any(getattr(arguments, name, ()) for name in others)
    return tuple(out if given else stored_wanted(bpy.context.scene))


def _open(arguments: argparse.Namespace) -> None:
    warning = open_blend(arguments.blend, arguments.allow_scripts)
    if warning is not None:
        _print_warnings([warning])


def _request(arguments: argparse.Namespace) -> Request:
    """The fit of the arguments; without a target, that of the .blend, of which arguments change parts."""
    own = has_targets(arguments)
    request = Request(pictures(arguments), Names()) if own else stored_request()
    names, animated, field = _names(arguments), _wanted(arguments), field_options.field_request(arguments)
    if own or names != Names() or arguments.parameter or arguments.keyed or arguments.all_of or field is not None:
        request = replace(request, names=names, animated=animated, field=field)
    own_options = vertex_options.of_arguments(arguments, request.names.vertices, request.vertex_options)
    request = replace(request, vertex_options=own_options)
    given = {name: getattr(arguments, name) for name in REQUEST_FIELDS} | beginning(arguments)
    if arguments.in_place or arguments.shape_key:
        given["in_place"] = arguments.in_place
    request = replace(request, film=_film(arguments, request.film))
    return replace(request, seed=arguments.seed, **{name: one for name, one in given.items() if one is not None})


def _film(arguments: argparse.Namespace, stored: FrameRange | None) -> FrameRange | None:
    """The frames of the arguments, or else those that the .blend has stored."""
    film = arguments.frames or stored
    given = {name: one for name, one in (("smoothness", arguments.frame_smoothness),
                                         ("first_every", arguments.first_every)) if one is not None}  # fmt: skip
    if given and film is None:
        raise Problem("--frame-smoothness and --first-every belong to a film; name its frames by --frames FIRST:LAST")
    return None if film is None else replace(film, **given)


def _fit(arguments: argparse.Namespace) -> list[str]:
    output = FitOutput(arguments.out, arguments.save, shows=not arguments.json_progress)
    output.check()
    if arguments.checkpoint is not None:
        check_checkpoint(arguments.checkpoint)
    elif arguments.resume:
        raise Problem("--resume needs a --checkpoint; name its file")
    _open(arguments)
    with stored_settings():
        session = Session.prepare(bpy.context, _request(arguments))
    output.prepare(session)
    warned, notes = session.export.report.lines, list(session.notes)
    if arguments.save is None:
        notes.append("the fitted scene will not be saved; --save BLEND saves it as a file")
    _print_warnings(warned)
    _print_notes(notes)
    tell = _tell_json if arguments.json_progress else None
    if tell is not None:
        write_line("begin", iterations=session.request.iterations, parameters=list(session.destinations),
                   warnings=warned, notes=notes)  # fmt: skip
    output.write_before(session)
    keep = {"checkpoint": arguments.checkpoint, "checkpoint_every": arguments.checkpoint_every,
            "resume": arguments.resume}  # fmt: skip
    if tell is not None:
        result = session.run(callback=tell, **keep)
    else:
        with ProgressBar("fit") as bar:
            note = ""

            def show(step: FitStep) -> None:
                nonlocal note
                ends = "   finishing" if step.iteration == step.iterations else ""
                note = f"{step.iteration} / {step.iterations}   loss {step.smoothed:.4g}{ends}"

            result = session.run(callback=show, progress=_shown(bar, lambda: note), **keep)
    with stored_settings():
        session.write(result)
    failures = [*session.unwritten, *output.write(session, result)]
    late = [note for note in session.late_notes if note not in session.unwritten]  # these are failures
    late = [*(note for note in result.notes if note not in session.notes), *late]
    _print_notes(late)
    where = f", saved as '{arguments.save}'" if arguments.save in output.written else ""
    losses = f"{result.losses[0]:.5g} -> {result.losses[result.best]:.5g}"
    _say(f"loss {losses} in {result.seconds:.1f} s{where}", sys.stderr if arguments.json_progress else sys.stdout)
    if arguments.json_progress:
        write_line("end", first_loss=result.losses[0], best_loss=result.losses[result.best], best=result.best,
                   seconds=result.seconds, notes=late, written=[str(path) for path in output.written])  # fmt: skip
    return failures


def _tell_json(step: FitStep) -> None:
    write_line("step", iteration=step.iteration, iterations=step.iterations, loss=step.loss, smoothed=step.smoothed,
               best=step.best, seconds=step.seconds)  # fmt: skip


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
    with stored_settings():
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
