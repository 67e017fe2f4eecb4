"""Output files of ``edgegrad fit``: the fitted .blend, a report, and pictures of each camera before and after."""

from __future__ import annotations

import dataclasses
import json
import os
import tempfile
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import numpy as np

import edgegrad
from edgegrad import images
from edgegrad.images.output_files import check_output_folder, check_outputs, replacing
from edgegrad.progress import ProgressBar

from .blend_file import save_blend
from .problem import Problem
from .session import Session
from .targets.pictures import absolute

SPP = 64  # samples per pixel of the pictures
BEFORE, AFTER = "before", "after"
SUFFIXES = (".exr", ".png")
# Errors of one picture that must not prevent the output of other files.
NOT_RENDERED = (ValueError, RuntimeError, FloatingPointError, MemoryError)
# Bytes of a picture's name for the name of its camera; file systems limit the whole name to 255 bytes.
NAME_BYTES = 200


@dataclass
class FitOutput:
    """The output files of a fit. They are checked before the fit; after it, the fitted scene is written first.

    Attributes
    ----------
    folder
        Folder for pictures and the report; None: they are not written.
    blend
        File for the fitted scene; None: it is not saved.
    shows
        Whether the terminal shows how far the pictures are.
    names
        Maps a camera to the name of its pictures, without prefix and suffix; set by `prepare`.
    written
        Result files that have been written so far.
    """

    folder: Path | None
    blend: Path | None
    shows: bool = False
    names: dict[str, str] = field(default_factory=dict)
    written: list[Path] = field(default_factory=list)

    def check(self) -> None:
        """Raise `WriteError` unless the .blend and files in the folder can be written. No .blend need be open."""
        if self.blend is not None:
            check_outputs([self.blend], (".blend",))
        if self.folder is not None:
            check_output_folder(self.folder)

    def prepare(self, session: Session) -> None:
        """Create the folder, and choose the names of all files in it.

        Raises
        ------
        WriteError
            If a file cannot be written.
        Problem
            If a file would replace a target or a mask.
        """
        if self.folder is None:
            return
        pictures = session.request.pictures
        self.names = picture_names(list(shown_pictures(session)))
        self.folder.mkdir(parents=True, exist_ok=True)
        inputs = {os.path.realpath(absolute(path)) for one in pictures for path in (one.image, one.mask) if path}
        outputs = [path for name in self.names for prefix in (BEFORE, AFTER) for path in self._pictures(prefix, name)]
        for path in outputs:
            if os.path.realpath(path) in inputs:
                raise Problem(f"file '{path}': is a target or a mask of this fit, and --out '{self.folder}' would "
                              "replace it; choose another folder")  # fmt: skip
        check_outputs(outputs, SUFFIXES)
        check_outputs([self._report], (".json",))

    def write_before(self, session: Session) -> None:
        """Write the pictures of the cameras before the fit; raise `Problem` at the first failure."""
        for failure in self._write_pictures(session, BEFORE, session.before):
            raise Problem(failure)

    def write(self, session: Session, result: edgegrad.FitResult) -> list[str]:
        """Write the fitted scene, then the report, then the pictures. A failure of one does not stop the others.

        Returns
        -------
        A sentence for each failure.

        Raises
        ------
        KeyboardInterrupt
            If the user interrupts; names the files that were written, and the failures.
        """
        failures: list[str] = []
        self.written.clear()
        try:
            if self.blend is not None:
                failures += self._save(self.blend)
            if self.folder is not None:
                failures += self._write_report(session, result)
                failures += self._write_pictures(session, AFTER, result.values)
        except KeyboardInterrupt:
            done = ", ".join(f"'{path}'" for path in self.written) or "no file"
            said = "; ".join([f"the fit had ended; of its result, {done} was written", *failures])
            raise KeyboardInterrupt(said) from None
        return failures

    def _save(self, blend: Path) -> Iterator[str]:
        try:
            save_blend(blend)
            self.written.append(blend)
            return
        except OSError as error:
            yield str(error)
        # The fit may have taken hours, so a full disk must not lose its result: try the temporary folder.
        try:
            rescue = _save_in_temporary_folder(blend.name)
            self.written.append(rescue)
            yield f"the fitted scene was saved as '{rescue}' instead of '{blend}'"
        except OSError as error:
            yield f"the fitted scene can't be saved in the temporary folder either: {error}"

    @property
    def _report(self) -> Path:
        assert self.folder is not None
        return self.folder / "report.json"

    def _pictures(self, prefix: str, camera: str) -> list[Path]:
        assert self.folder is not None
        return [self.folder / f"{prefix}_{self.names[camera]}{suffix}" for suffix in SUFFIXES]

    def _write_pictures(self, session: Session, prefix: str, values: Mapping[str, Any]) -> Iterator[str]:
        """Render and write the pictures; yield a sentence for each failure."""
        if self.folder is None:
            return
        limits, film = session.export.settings, session.request.film is not None
        renderer: edgegrad.Renderer | None = None
        shown = shown_pictures(session)
        with ProgressBar(f"pictures {prefix}") if self.shows else nullcontext() as bar:
            for done, (name, view) in enumerate(shown.items()):

                def tell(part: float, done: int = done) -> None:
                    if bar is not None:
                        bar.update((done + part) / len(shown))

                try:
                    if renderer is None or film:  # each frame shows another scene
                        renderer = edgegrad.Renderer(session.scene_of(values, view), threads=session.threads)
                except NOT_RENDERED as error:
                    yield f"the pictures {prefix} the fit can't be rendered ({error})"
                    return
                try:
                    pixels = renderer.render(spp=SPP, max_depth=limits.max_depth, bounces=limits.bounces, progress=tell,
                                             camera=None if film else session.targets[view].camera)  # fmt: skip
                except NOT_RENDERED as error:
                    yield f"camera '{name}': its picture {prefix} the fit can't be rendered ({error})"
                    continue
                for path in self._pictures(prefix, name):
                    try:
                        images.write_image(path, pixels)
                        self.written.append(path)
                    except (OSError, ValueError) as error:
                        yield str(error)

    def _write_report(self, session: Session, result: edgegrad.FitResult) -> Iterator[str]:
        film = session.request.film
        keyed = [] if film is None or session.driver is None else [one.path for one in session.driver.variables]
        values = {name: np.asarray(value).tolist() for name, value in result.values.items()
                  if np.size(value) <= 3 or name in keyed}  # fmt: skip
        report: dict[str, Any] = {
            "losses": result.losses,
            "best": result.best,
            "seconds": result.seconds,
            "values": values,
            "frames": None if film is None else list(film.times),
            "untouched": result.untouched,
            "findings": [dataclasses.asdict(one) | {"sentence": str(one)} for one in result.findings],
            "uncertainty": [told(one) for one in result.uncertainty],
            "exchanges": [dataclasses.asdict(one) | {"sentence": str(one)} for one in result.exchanges],
            "warnings": session.export.report.lines,
            "notes": [*result.notes, *session.gain_notes],
            "pictures": {
                camera: {prefix: [path.name for path in self._pictures(prefix, camera)] for prefix in (BEFORE, AFTER)}
                for camera in self.names
            },
        }
        try:
            with replacing(self._report) as temporary:
                temporary.write_text(json.dumps(report, indent=1) + "\n")
            self.written.append(self._report)
        except OSError as error:
            yield str(error)


def told(one: edgegrad.Uncertainty) -> dict[str, Any]:
    """Return what is known about a parameter, for JSON: errors that are not known are null; of arrays, the median."""
    known = one.errors[np.isfinite(one.errors)]
    errors = [float(error) if np.isfinite(error) else None for error in one.errors] if one.names else None
    return {"path": one.path, "names": one.names, "units": one.units, "values": one.values, "errors": errors,
            "median_error": float(np.median(known)) if known.size else None, "open": one.open,
            "ahead": one.ahead, "sentence": str(one)}


def shown_pictures(session: Session) -> dict[str, int]:
    """Return the targets whose pictures are written, by name: one of each camera, of a film its first, middle and last
    frame.
    """
    of: dict[str, list[int]] = {}
    for view, picture in enumerate(session.request.pictures):
        of.setdefault(picture.camera, []).append(view)
    if session.request.film is None:
        return {camera: views[-1] for camera, views in of.items()}
    return {f"{camera}_{session.request.pictures[view].time:04d}": view for camera, views in of.items()
            for view in (views[0], views[len(views) // 2], views[-1])}  # fmt: skip


def _save_in_temporary_folder(name: str) -> Path:
    folder = Path(tempfile.mkdtemp(prefix="edgegrad-"))
    try:
        save_blend(folder / name)
    except OSError:
        folder.rmdir()
        raise
    return folder / name


def picture_names(cameras: Sequence[str]) -> dict[str, str]:
    """Choose a file name for each camera: its own name with safe characters, and a number if two names would be equal.

    Names that differ only in case or in the encoding of accents count as equal, as on some file systems.
    """
    out: dict[str, str] = {}
    taken: set[str] = set()
    # Cameras whose own name is safe come first, so that they keep it without a number.
    for camera in sorted(cameras, key=lambda camera: _safe(camera) != camera):
        name, number = _safe(camera), 1
        while _as_compared(name) in taken:
            number += 1
            name = f"{_safe(camera)}_{number}"
        taken.add(_as_compared(name))
        out[camera] = name
    return {camera: out[camera] for camera in cameras}


def _safe(name: str) -> str:
    return bpy.path.clean_name(name).encode()[:NAME_BYTES].decode(errors="ignore")


def _as_compared(name: str) -> str:
    return unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold())
