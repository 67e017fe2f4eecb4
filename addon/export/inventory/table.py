"""Tables of settings, and their look-up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any


class _Default:
    """Stands for the default of a property in Blender."""


DEFAULT = _Default()


def _always(struct: Any, scene: Any) -> bool:
    return True


@dataclass(frozen=True)
class Named:
    """A setting that changes the picture and is not read.

    Attributes
    ----------
    sentence
        What is done instead; ``{value}`` is the value of the setting.
    neutral
        Value at which the setting changes nothing.
    acts
        Whether other settings of the structure, and those of Blender's scene, let it act.
    warns
        False: it belongs to how Cycles estimates the picture and is on in most files, so it is told as a reading.
    """

    sentence: str
    neutral: Any = DEFAULT
    acts: Callable[[Any, Any], bool] = _always
    warns: bool = True


@dataclass(frozen=True)
class Table:
    """The settings of one structure, or of one type of node.

    Attributes
    ----------
    read
        Names of the settings that are read, separated by blanks; of sockets, by their identifiers with _ for blanks.
    without
        Maps the reason why settings change nothing to their names, which may contain ``*``.
    named
        The settings that are named, by name.
    nested
        Names of the structures in this one that have a table of their own.
    """

    read: str = ""
    without: Mapping[str, str] = field(default_factory=dict)
    named: Mapping[str, Named] = field(default_factory=dict)
    nested: str = ""

    def knows(self, name: str) -> bool:
        """Whether the setting is in this table."""
        exact = {*self.read.split(), *self.nested.split(), *self.named}
        return name in exact or any(fnmatchcase(name, pattern) for names in self.without.values()
                                    for pattern in names.split())  # fmt: skip


# Reasons why settings change nothing in the picture.
EEVEE = "only EEVEE, Workbench or the viewport uses it"
DISPLAY = "how editors show it"
EVALUATED = "Blender applies it before the export reads the evaluated data"
NOISE = "it changes noise, seconds or memory, not the expected picture"
PASSES = "it concerns passes other than the picture, or the file that they are written to"
VOLUMES = "it concerns volumes that vary only, which are named where they are left out"
MOTION = "it concerns motion blur only, which is named at the scene"
OTHER = "it belongs to another tool: Grease Pencil, Line Art, Freestyle, simulations, the game engine of old files"
DATA = "it manages Blender's data"
BAKING = "it concerns Blender's own baking"
AFTER = "it is applied after the linear picture is rendered: view transform, compositor, sequencer, files"
