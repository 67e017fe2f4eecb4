"""How sentences name many objects: the first few by name, the others by their number."""

from __future__ import annotations

from collections.abc import Callable, Sequence

# Objects that a sentence names, and sentences that say the same of different objects. Plans are read by people, and of
# a scene of many thousands of meshes none is worth a name of its own.
MOST_NAMED = 10
MOST_SENTENCES = 100


def listed(names: Sequence[str]) -> str:
    """Some names with commas; of more than `MOST_NAMED` the first, and how many others there are."""
    if len(names) <= MOST_NAMED:
        return ", ".join(names)
    return f"{', '.join(names[: MOST_NAMED - 1])} and {len(names) - MOST_NAMED + 1:,} others"


def sentence_each(
    names: Sequence[str], sentence: Callable[[str], str], others: str, *, more: bool = False
) -> list[str]:
    """One sentence for each of some names; of more than `MOST_NAMED` the last one is for all others together.

    Parameters
    ----------
    sentence
        Makes a sentence with a name, or with "12 other `others`" in its place.
    others
        What is counted, in the plural.
    more
        Whether there may be more than are given.
    """
    if len(names) <= MOST_NAMED and not more:
        return [sentence(name) for name in names]
    shown = names[: MOST_NAMED - 1]
    count = f"{'at least ' if more else ''}{len(names) - len(shown):,} other {others}"
    return [*(sentence(name) for name in shown), sentence(count)]
