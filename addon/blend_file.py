"""Opening of .blend files without running their Python scripts, and atomic saving."""

from __future__ import annotations

import os
import shutil
import struct
import sys
from pathlib import Path

import bpy

from edgegrad.images.output_files import replacing

from .problem import Problem

# An uncompressed .blend ends with the header of an empty block with this code. From Blender 5.0 on, block headers are
# longer, and the file starts with the length of its own header ("BLENDER17-…" instead of "BLENDER-…").
END = b"ENDB"
END_BYTES, END_BYTES_BEFORE_5 = 32, 24
# A compressed .blend ends with the seek table of Zstandard: the sizes of the frames, their number, flags and this magic
# number.
SEEK_TABLE = 0x8F92EAB1
FOOTER = struct.Struct("<IBI")
SKIPPABLE_HEADER_BYTES = 8
CHECKSUMS = 0x80  # flag: a checksum follows the sizes of each frame


def open_blend(blend: str | None, allow_scripts: bool) -> str | None:
    """Open a file, unless it is already open in Blender.

    Parameters
    ----------
    blend
        The file; None: the file that is open.
    allow_scripts
        Whether Python scripts in the file (drivers, registered texts) may run.

    Returns
    -------
    A warning for the user if scripts in the file were not run or no file is open; else None.

    Raises
    ------
    Problem
        If the file cannot be opened, or if `allow_scripts` comes too late: Blender has opened the file without scripts.
    """
    opened = bpy.data.filepath and Path(bpy.data.filepath).resolve()
    path = opened if blend is None else Path(blend).resolve()
    if path != opened:
        if not path.is_file():
            raise Problem(f"file '{blend}': there is no such file")
        try:
            bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=allow_scripts)
        except RuntimeError as error:
            raise Problem(f"file '{blend}': can't be opened ({str(error).strip()})") from None
    if not path:
        missed = _asked_of_blender()
        if missed is not None:
            raise Problem(f"file '{missed}': Blender has not opened it (there is no such file, or it is damaged or too "
                          "new for this Blender); its messages above say why")  # fmt: skip
        return "no .blend is given or open, so the scene that Blender starts with is used"
    if not bpy.app.autoexec_fail:
        return None
    skipped = f"file '{blend or opened}': Python in it was not run ({bpy.app.autoexec_fail_message})"
    if path != opened:
        return f"{skipped}; if you trust the file, allow it with --allow-scripts"
    cure = "if you trust the file, start Blender with --enable-autoexec"
    if allow_scripts:
        raise Problem(f"{skipped} when Blender opened it, before --allow-scripts was read; {cure}")
    return f"{skipped}; {cure}"


def _asked_of_blender() -> str | None:
    """Return the .blend that Blender's own arguments name, before --command; None: there is none."""
    own: list[str] = []
    for argument in sys.argv[1:]:
        if argument in ("-c", "--command", "--"):
            return next((one for one in own if one.lower().endswith(".blend")), None)
        own.append(argument)
    return None  # not started by Blender's --command


def save_blend(path: Path) -> None:
    """Save the open .blend into a file, and keep earlier versions of the file as set in Blender's preferences.

    Raises
    ------
    WriteError
        If the file cannot be written; names the file. An earlier file stays unchanged.
    """
    with replacing(path) as temporary:
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(temporary), copy=True, check_existing=False)
        except RuntimeError as error:
            raise OSError(_with_free_space(str(error).strip(), temporary.parent)) from None
        if not is_complete(temporary):
            raise OSError(_with_free_space("Blender wrote only a part of it", temporary.parent))
        _keep_versions(Path(os.path.realpath(path)))


def is_complete(path: Path) -> bool:
    """Whether a .blend file is complete. Blender reports no error if it writes a compressed file to a full disk."""
    with path.open("rb") as file:
        start = file.read(8)
        size = file.seek(0, os.SEEK_END)
        if start.startswith(b"BLENDER"):
            file.seek(max(size - (END_BYTES if start[7:].isdigit() else END_BYTES_BEFORE_5), 0))
            return file.read(len(END)) == END
        if size < FOOTER.size:
            return False
        file.seek(size - FOOTER.size)
        frames, flags, magic = FOOTER.unpack(file.read())
        entry = 12 if flags & CHECKSUMS else 8
        table = SKIPPABLE_HEADER_BYTES + frames * entry + FOOTER.size
        if magic != SEEK_TABLE or table > size:
            return False
        file.seek(size - table + SKIPPABLE_HEADER_BYTES)
        entries = file.read(frames * entry)
        return table + sum(struct.unpack_from("<I", entries, k * entry)[0] for k in range(frames)) == size


def _with_free_space(text: str, folder: Path) -> str:
    """Add the free disk space to Blender's reason, which is often wrong: Blender reads the error number too late."""
    return f"{text}; {shutil.disk_usage(folder).free / 1e6:.3g} MB are free in its folder"


def _keep_versions(path: Path) -> None:
    """Rename NAME.blend to NAME.blend1, NAME.blend1 to NAME.blend2 …, as Blender does when it overwrites a file."""
    for number in range(bpy.context.preferences.filepaths.save_version, 0, -1):
        earlier = path.with_name(f"{path.name}{number - 1 or ''}")
        later = path.with_name(f"{path.name}{number}")
        if not earlier.exists() or (later.exists() and later.samefile(earlier)):
            continue
        with replacing(later) as temporary:
            try:
                temporary.hardlink_to(earlier)  # needs no space, and `path` always exists
            except OSError:  # a file system without hard links
                shutil.copy2(earlier, temporary)
