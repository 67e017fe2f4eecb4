"""`Film`: the frames of the targets of a fit, and how they are fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from ..._check import names, number, shown, whole
from ..._fields import Check, Checked, by

# Frames of Blender's timeline.
MOST_FRAME = 1_048_574


def _frames(where: str, name: str, value: Any) -> tuple[int, ...]:
    try:
        found = tuple(value)
    except TypeError:
        raise ValueError(f"{where}: {name} must be a list of whole numbers, not {shown(value)}") from None
    if not found:
        raise ValueError(f"{where}: {name} is empty; give the frame of each target")
    return tuple(whole(where, f"{name}[{k}]", one, -MOST_FRAME, MOST_FRAME) for k, one in enumerate(found))


@dataclass
class Film(Checked):
    """The frames of the targets, and how they are fitted.

    Attributes
    ----------
    frames
        Frame of each target, in the order of the targets. Several targets may show one frame.
    keyed
        Paths of parameters that have a value of their own in each frame: transforms of meshes, camera-to-world matrices
        of cameras and lights, and numbers. They are not in `wrt`. All other parameters have one value for all frames.
    smoothness
        Weight of the prior over time. It adds the sum of the squared second differences of the keyed values by the
        frame number, in units of their first steps, times this weight and the loss of a picture of one colour. 0: none.
    first_every
        The fit begins with every n-th frame and the last one, one after the other; each starts from the one before.
        Then come the frames halfway between, which start between their neighbours, and so on; at last all frames
        together.
    """

    frames: Sequence[int]
    keyed: Sequence[str] = ()
    smoothness: float = 1e-3
    first_every: int = 8

    checks: ClassVar[Mapping[str, Check]] = {
        "frames": _frames,
        "keyed": by(names, "parameter paths"),
        "smoothness": by(number, least=0.0, greatest=1e6),
        "first_every": by(whole, 1, 1_000_000),
    }

    @property
    def times(self) -> list[int]:
        """The frames in their order, each once."""
        return sorted(set(self.frames))

    @property
    def of_views(self) -> list[int]:
        """Index in `times` of each target's frame."""
        index = {frame: k for k, frame in enumerate(self.times)}
        return [index[frame] for frame in self.frames]
