"""Broken checkpoints and calibrations: cut off, with changed bytes, and with values that do not belong there."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from edgegrad import calibration, fit, read_checkpoint
from tests.torture.malformed_files import SHARES
from tests.torture.valid import COLOR, valid_scene

Contents = dict[str, bytes]
# Kinds of files, and words of which an error about them has one.
STORES = {"checkpoint": ("checkpoint", "a.npz"), "transforms": ("calibration",), "colmap": ("calibration",)}
FLIPS = 40
_POSE = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 4.0], [0.0, 0.0, 0.0, 1.0]]
# Values of JSON in the place of others.
WRONG: tuple[Any, ...] = (None, True, -1, 0, 1e400, -1e400, 10**30, 1e-320, "", "7", "x" * 1000, [], [[]], {}, [1, "a"],
                          {"a": None}, [[1.0]] * 4, [[0.0] * 4] * 4, [[1e300] * 4] * 4, "a\0b", "../../a")  # fmt: skip
WORDS = ("", "nan", "inf", "-1", "0", "1e400", "x", "OPENCV", "99999999999999999999", "#", "\0", "1_0", "\u0661",
         "1e18")
_CAMERAS = "# cameras\n1 OPENCV 6 4 5 5 3 2 0.1 0 0 0\n2 PINHOLE 6 4 5 5 3 2\n"
_IMAGES = "# images\n1 1 0 0 0 0 0 4 1 a.png\n\n2 0.7 0.7 0 0 0 1 4 2 b.png\n1.0 2.0 -1\n"


def transforms() -> dict[str, Any]:
    frame = {"file_path": "a.png", "transform_matrix": _POSE}
    return {"w": 6, "h": 4, "fl_x": 5.0, "fl_y": 5.0, "cx": 3.0, "cy": 2.0, "k1": 0.1, "camera_model": "OPENCV",
            "camera_angle_x": 1.0, "k4": 0.0, "frames": [frame, {**frame, "file_path": "b.png", "w": 8}]}  # fmt: skip


def whole_checkpoint() -> bytes:
    """The file of a fit of two steps."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.npz"
        fit(valid_scene(), np.ones((4, 4, 3), np.float32), [COLOR], iterations=2, spp=1, threads=1,
                     checkpoint=path, checkpoint_every=1)  # fmt: skip
        return path.read_bytes()


@cache
def whole() -> dict[str, Contents]:
    """Valid files by what they are; each value has the files of a folder."""
    return {
        "checkpoint": {"a.npz": whole_checkpoint()},
        "transforms": {"transforms.json": json.dumps(transforms()).encode()},
        "colmap": {"cameras.txt": _CAMERAS.encode(), "images.txt": _IMAGES.encode()},
    }


def read(kind: str, contents: Contents) -> Any:
    """What the library reads."""
    with tempfile.TemporaryDirectory() as folder:
        for name, data in contents.items():
            (Path(folder) / name).write_bytes(data)
        if kind == "checkpoint":
            return read_checkpoint(Path(folder) / "a.npz")
        found = calibration.read_calibration(Path(folder) / "transforms.json" if kind == "transforms" else folder)
        for one in found:
            one.camera.validate()
        return found


def broken_stores() -> Iterator[tuple[str, str, Contents]]:
    """What is wrong, the kind of file, and the files."""
    for kind, contents in whole().items():
        yield f"{kind}: whole", kind, contents
        for name, data in contents.items():
            for what, changed in _changed(data):
                yield f"{kind}: {name}: {what}", kind, {**contents, name: changed}
            yield f"{kind}: {name}: missing", kind, {other: one for other, one in contents.items() if other != name}
    for what, value in _wrong_values():
        yield f"transforms: {what}", "transforms", {"transforms.json": json.dumps(value).encode()}
    for name, text in (("cameras.txt", _CAMERAS), ("images.txt", _IMAGES)):
        for k, wrong in enumerate(_wrong_words(text)):
            yield f"colmap: {name}: word {k}", "colmap", {**whole()["colmap"], name: wrong.encode()}


def _changed(data: bytes) -> Iterator[tuple[str, bytes]]:
    for share in SHARES:
        yield f"cut off at {share:.0%}", data[: int(share * len(data))]
    yield "without the last byte", data[:-1]
    rng = np.random.default_rng(FLIPS)
    for k in range(FLIPS):
        changed = bytearray(data)
        for at in rng.integers(0, len(data), 1 + k % 4):
            changed[at] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, changed[at] ^ (1 << int(rng.integers(8)))])
        yield f"changed {k}", bytes(changed)


def _wrong_values() -> Iterator[tuple[str, Any]]:
    for k, wrong in enumerate(WRONG):
        yield f"all wrong {k}", wrong
        for key in transforms():
            yield f"{key} wrong {k}", {**transforms(), key: wrong}
        yield f"frame wrong {k}", {**transforms(), "frames": [wrong]}
        for key in ("file_path", "transform_matrix", "fl_x"):
            yield f"frame's {key} wrong {k}", {**transforms(), "frames": [{**transforms()["frames"][0], key: wrong}]}
    for key in transforms():
        yield f"without {key}", {name: value for name, value in transforms().items() if name != key}


def _wrong_words(text: str) -> Iterator[str]:
    lines = text.split("\n")
    for row, line in enumerate(lines):
        for place in range(len(line.split(" "))):
            for word in WORDS:
                words = line.split(" ")
                words[place] = word
                yield "\n".join([*lines[:row], " ".join(words), *lines[row + 1 :]])
