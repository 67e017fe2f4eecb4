"""Errors for the user, the report of an export (warnings and readings, each issued once), as Blender writes them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

# The subject of a warning, at the start of its line.
SUBJECT = re.compile(r"(object|material|light|world) '(.*?)'(?:, |: )")
# Parts of words of the library as Blender spells them.
SPELT = {"olour": "olor", "eighbour": "eighbor", "centre": "center", "grey": "gray", "metre": "meter"}
# A word at the start of a sentence, which is no name of the code such as `max_depth`.
WORD = re.compile(r"[a-z][a-z'’-]*(?=[\s:,;]|$)")


class Problem(RuntimeError):
    """An error that the user can correct; its text is one sentence."""


def counted(count: int, one: str, several: str) -> str:
    """Write a number of things: '1 parameter is', '1,200 parameters are'."""
    return f"{count:,} {one if count == 1 else several}"


def spelt(text: str) -> str:
    """Spell a sentence of the library as Blender does, but not the names in quotes."""
    parts = re.split(r"((?<!\w)'[^']*')", text)  # an apostrophe within a word opens no name
    for british, american in SPELT.items():
        parts = [part if part.startswith("'") else part.replace(british, american) for part in parts]
    return "".join(parts)


def sentence(text: str) -> str:
    """Write a message of the library as Blender does: in its spelling, with a capital letter."""
    text = spelt(text)
    return text[:1].upper() + text[1:] if WORD.match(text) else text


@dataclass
class Report:
    """Warnings and other messages of an export.

    Attributes
    ----------
    lines
        Warnings, each about one object, light or node; they say what was done instead.
    readings
        One line per material and world, which says what was read, baked or approximated, and lines about settings
        of the scene that Edgegrad does not support.
    """

    lines: list[str] = field(default_factory=list)
    readings: list[str] = field(default_factory=list)
    _seen: set[tuple[str, str]] = field(default_factory=set, repr=False)

    def warn(self, where: str, what: str) -> None:
        """Add the warning `what` about the object `where` ("light 'Sun'"), once."""
        self._add(self.lines, where, what)

    def tell(self, where: str, what: str) -> None:
        """Add a line on how `where` was read, once."""
        self._add(self.readings, where, what)

    def subjects(self) -> Iterator[tuple[str, str]]:
        """Yield kind and name of the object, material, light or world that each warning is about."""
        for line in self.lines:
            found = SUBJECT.match(line)
            if found is not None:
                yield found[1], found[2]

    def append(self, effects: Mapping[tuple[str, str], str]) -> None:
        """Append to each warning the text, in brackets, of its subject."""
        for k, line in enumerate(self.lines):
            found = SUBJECT.match(line)
            text = None if found is None else effects.get((found[1], found[2]))
            if text is not None:
                self.lines[k] = f"{line} ({text})"

    def _add(self, lines: list[str], where: str, what: str) -> None:
        if (where, what) not in self._seen:
            self._seen.add((where, what))
            lines.append(f"{where}: {what}")
