"""Films as targets: the frames of a movie or of numbered pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..problem import Problem
from .film_files import file_at, is_numbered
from .frames import is_movie
from .pictures import Picture, absolute

MOST_FRAMES = 10_000


@dataclass(frozen=True)
class FrameRange:
    """The frames of a film that are fitted.

    Attributes
    ----------
    first, last, step
        Frames of Blender's timeline.
    smoothness, first_every
        As for `edgegrad.Film`.
    """

    first: int
    last: int
    step: int = 1
    smoothness: float = 1e-3
    first_every: int = 8

    @staticmethod
    def parse(text: str) -> FrameRange:
        """Read FIRST:LAST or FIRST:LAST:STEP; raise `ValueError` for another form."""
        parts = text.split(":")
        try:
            numbers = [int(one) for one in parts]
        except ValueError:
            numbers = []
        if len(numbers) not in (2, 3):
            raise ValueError(f"must have the form FIRST:LAST or FIRST:LAST:STEP, such as 1:48, not '{text}'")
        out = FrameRange(*numbers)
        out.check()
        return out

    def check(self) -> None:
        """Raise `ValueError` for a range without frames."""
        if self.first < 0 or self.last < self.first or self.step < 1:
            raise ValueError(f"must go from a frame of at least 0 upwards, not from {self.first} to {self.last} in "
                             f"steps of {self.step}")  # fmt: skip
        if len(self.times) > MOST_FRAMES:
            raise ValueError(f"has {len(self.times):,} frames; choose {MOST_FRAMES:,} or fewer, with a step")

    @property
    def times(self) -> range:
        """The frames."""
        return range(self.first, self.last + 1, self.step)

    def pictures(self, targets: list[Picture], now: int) -> list[Picture]:
        """Return one target for each frame of each film among the targets; single pictures show one frame.

        Raises
        ------
        Problem
            If a single picture shows a frame that is not in the range, or a numbered file is missing; names it.
        """
        out: list[Picture] = []
        for one in targets:
            if self._is_film(one):
                out += [self._frame(one, frame) for frame in self.times]
                continue
            frame = now if one.frame is None else one.frame
            if frame not in self.times:
                raise Problem(f"target '{one.name}' of camera '{one.camera}': is a single picture, of frame {frame}, "
                              f"which is not in the frames {self.first} to {self.last} of the fit; set its frame, or "
                              "name a movie or numbered files (film.%04d.png)")  # fmt: skip
            out.append(replace(one, time=frame))
        return out

    @staticmethod
    def _is_film(picture: Picture) -> bool:
        if picture.datablock:
            import bpy

            image = bpy.data.images.get(picture.datablock)
            return image is not None and image.source in ("MOVIE", "SEQUENCE") and picture.frame is None
        return _is_numbered(picture.image) or (picture.frame is None and is_movie(absolute(picture.image)))

    @staticmethod
    def _frame(picture: Picture, frame: int) -> Picture:
        found = replace(picture, frame=frame, time=frame)
        for name in ("image", "mask"):
            path = getattr(picture, name)
            if not _is_numbered(path):
                continue
            path = file_at(path, frame)
            if not absolute(path).is_file():
                raise Problem(f"{name} '{getattr(picture, name)}' of camera '{picture.camera}': there is no file "
                              f"'{path}' of frame {frame}; choose other frames")  # fmt: skip
            setattr(found, name, path)
        return found


def _is_numbered(path: str) -> bool:
    """Whether a path stands for one file a frame, and is not itself the name of a file."""
    return is_numbered(path) and not absolute(path).is_file()


def frame_of(picture: Picture) -> int:
    """Return the frame that a target of a film shows."""
    assert picture.time is not None
    return picture.time
