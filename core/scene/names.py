"""Lists of object names in sentences: the first few names, then the count of the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence

# Largest number of names in one sentence, and of sentences that differ only in the name. People read plans, and a scene
# may have thousands of meshes.
MOST_NAMED = 10
MOST_SENTENCES = 100


def listed(names: Sequence[str], count: int | None = None) -> str:
    """Join names with commas; with more than `MOST_NAMED` names, only the first ones and the count of the others.

    `count`: the number of all names, if `names` has only the first `MOST_NAMED` of them.
    """
    count = len(names) if count is None else count
    if count <= MOST_NAMED:
        return ", ".join(names)
    return f"{', '.join(names[: MOST_NAMED - 1])} and {count - MOST_NAMED + 1:,} others"


def sentence_each(
    names: Sequence[str], sentence: Callable[[str], str], others: str, count: int | None = None
) -> list[str]:
    """Make one sentence for each name; with more than `MOST_NAMED` names, the last sentence covers all others.

    Parameters
    ----------
    sentence
        Makes a sentence from a name, or from "12 other `others`".
    others
        What the names stand for, in the plural: "meshes".
    count
        As in `listed`.
    """
    count = len(names) if count is None else count
    if count <= MOST_NAMED:
        return [sentence(name) for name in names]
    shown = names[: MOST_NAMED - 1]
    return [*(sentence(name) for name in shown), sentence(f"{count - len(shown):,} other {others}")]
