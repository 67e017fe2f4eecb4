"""Results that could not be written, in a text block of the .blend, until they can be."""

from __future__ import annotations

import json
from collections.abc import Sequence

import bpy

from ..problem import Problem
from .destinations import Entry, StoredEntry

TEXT = "Edgegrad result"
DAMAGED = f"text '{TEXT}': was changed and can't be read; undo the change, or remove the text"


def keep(entries: Sequence[Entry]) -> None:
    """Add results to the text block; there are none: leave it as it is."""
    if entries:
        _store([*_stored(), *entries])


def write_kept() -> tuple[list[str], list[str]]:
    """Write all that is kept and can be written now; the rest stays in the text block.

    Returns
    -------
    Names of what was written, and a sentence for everything else.

    Raises
    ------
    Problem
        If nothing is kept, or if the text is damaged.
    """
    if bpy.data.texts.get(TEXT) is None:
        raise Problem(f"there is no text '{TEXT}' with a result that was not written")
    done, failed, left = [], [], []
    entries = _stored()
    for k, entry in enumerate(entries):
        try:
            stored = StoredEntry(entry)
            stored.write()
            done.append(stored.name)
        except Problem as problem:
            failed.append(str(problem))
            left.append(entry)
        except (KeyError, TypeError, ValueError, IndexError):
            _store([*left, *entries[k:]])  # what was written must not be written twice
            raise Problem(DAMAGED) from None
    _store(left)
    bpy.context.view_layer.update()
    return done, failed


def _stored() -> list[Entry]:
    text = bpy.data.texts.get(TEXT)
    if text is None:
        return []
    try:
        found = json.loads(text.as_string())["results"]
    except (ValueError, KeyError, TypeError):
        raise Problem(DAMAGED) from None
    return list(found)


def _store(entries: list[Entry]) -> None:
    text = bpy.data.texts.get(TEXT)
    if not entries:
        if text is not None:
            bpy.data.texts.remove(text)
        return
    text = text or bpy.data.texts.new(TEXT)
    text.clear()
    text.write(json.dumps({"results": entries}))
    text.use_fake_user = True
