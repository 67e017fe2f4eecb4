"""Sentences that fit into the width of a panel."""

from __future__ import annotations

import functools
import re
import textwrap
from typing import Any

# Mean width of a character, and width of the margins and an icon of a panel; pixels at scale 1.
CHARACTER, MARGINS = 6.6, 52
FIXED_SPACE = "\N{NO-BREAK SPACE}"
# Parts of words of the library as Blender spells them.
SPELT = {"olour": "olor", "eighbour": "eighbor", "centre": "center", "grey": "gray", "metre": "meter"}


def wrapped(context: Any, layout: Any, sentence: str, icon: str = "NONE") -> None:
    """Draw a sentence on as many lines as it needs."""
    scale = context.preferences.system.ui_scale
    width = max(16, int((context.region.width / scale - MARGINS) / CHARACTER))
    column = layout.column(align=True)
    column.scale_y = 0.8
    for k, line in enumerate(lines(sentence, width)):
        column.label(text=line, icon=icon if k == 0 or icon == "NONE" else "BLANK1")


@functools.lru_cache(maxsize=1024)
def lines(sentence: str, width: int) -> tuple[str, ...]:
    """Return the lines of a sentence, of as many characters at most, as Blender spells it.

    Numbers stay beside their units, and the numbers of a size together.
    """
    whole = re.sub(r"(?<=\d) (?=(s|min|h)\b|× \d)|(?<=×) (?=\d)", FIXED_SPACE, spelt(sentence))
    return tuple(line.replace(FIXED_SPACE, " ") for line in textwrap.wrap(whole, width))


def spelt(sentence: str) -> str:
    """Spell a sentence of the library as Blender does, but not the names in quotes."""
    parts = re.split(r"((?<!\w)'[^']*')", sentence)  # an apostrophe within a word opens no name
    for british, american in SPELT.items():
        parts = [part if part.startswith("'") else part.replace(british, american) for part in parts]
    return "".join(parts)
