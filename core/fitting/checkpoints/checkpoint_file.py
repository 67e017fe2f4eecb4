"""Files with the state of a fit: arrays in an npz archive, everything else as JSON in it; no pickles.

A file is written under a temporary name, flushed to the disk and renamed, so that a full disk or a killed process
leaves the earlier file whole.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...images.output_files import check_outputs, replacing

SUFFIX = ".npz"
FORMAT, VERSION = "edgegrad fit", 2
_JSON = "state"
# Key of the JSON object that stands for an array, with the array's name in the archive.
_ARRAY = "array"


class CheckpointError(ValueError):
    """Raised for a checkpoint that can't be read or belongs to another fit; the text is one sentence with its name."""


def check_checkpoint(path: str | Path) -> None:
    """Raise `WriteError` unless a checkpoint can be written there."""
    check_outputs([path], (SUFFIX,))


def write_checkpoint(path: str | Path, tree: dict[str, Any]) -> None:
    """Write dictionaries and lists of arrays, numbers, texts and None.

    Raises
    ------
    WriteError
        If the file can't be written; an earlier file stays whole.
    """
    arrays: dict[str, NDArray[Any]] = {}
    text = json.dumps({"format": FORMAT, "version": VERSION, "tree": _without_arrays(tree, arrays)})
    arrays[_JSON] = np.frombuffer(text.encode(), np.uint8)
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def read_tree(path: str | Path) -> dict[str, Any]:
    """Read what `write_checkpoint` has written.

    Raises
    ------
    CheckpointError
        If the file is no checkpoint, is damaged, or has another version; names it.
    OSError
        If there is no such file, or it can't be read.
    """
    where = f"checkpoint '{path}'"
    try:
        with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as archive:
            found = json.loads(archive[_JSON].tobytes())
            if not isinstance(found, dict) or found.get("format") != FORMAT:
                raise CheckpointError(f"{where}: is no checkpoint of a fit; name another file")
            if found["version"] != VERSION:
                raise CheckpointError(f"{where}: has the format {found['version']}, but this version of Edgegrad reads "
                                      f"{VERSION}; begin the fit anew, or use the version that wrote it")
            tree: dict[str, Any] = _with_arrays(found["tree"], archive)
            return tree
    except (CheckpointError, OSError, MemoryError):
        raise
    except Exception:  # archives with changed bytes ask for passwords and unknown compressions
        raise CheckpointError(f"{where}: is damaged or is no checkpoint of a fit; remove it, or name another "
                              "file") from None  # fmt: skip


def _without_arrays(value: Any, arrays: dict[str, NDArray[Any]]) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        name = f"a{len(arrays)}"
        arrays[name] = np.asarray(value)
        return {_ARRAY: name}
    if isinstance(value, dict):
        return {key: _without_arrays(one, arrays) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_without_arrays(one, arrays) for one in value]
    return value


def _with_arrays(value: Any, archive: Any) -> Any:
    if isinstance(value, dict):
        if value.keys() == {_ARRAY}:
            return archive[value[_ARRAY]]
        return {key: _with_arrays(one, archive) for key, one in value.items()}
    if isinstance(value, list):
        return [_with_arrays(one, archive) for one in value]
    return value
