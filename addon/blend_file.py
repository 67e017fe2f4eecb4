"""The .blend itself: opened without running the Python in it, saved completely or not at all."""

from __future__ import annotations

import os
import shutil
import struct
from pathlib import Path

import bpy

from edgegrad.images.output_files import replacing

from .problem import Problem

# An uncompressed .blend ends in the header of an empty block of this code; from Blender 5.0 on, headers are longer and
# the file's version number begins with the length of its own header ("BLENDER17-…" instead of "BLENDER-…").
END = b"ENDB"
END_BYTES, END_BYTES_BEFORE_5 = 32, 24
# The end of a compressed .blend is Zstandard's seek table: frames' sizes, then their number, flags and this number.
SEEK_TABLE = 0x8F92EAB1
FOOTER = struct.Struct("<IBI")
SKIPPABLE_HEADER_BYTES = 8
CHECKSUMS = 0x80  # flag: a checksum follows each frame's sizes


def open_blend(blend: str | None, allow_scripts: bool) -> str | None:
    """Open the file, unless Blender has it open already.

    Parameters
    ----------
    blend
        The file; None: the one that is open.
    allow_scripts
        Whether Python in the file (drivers, registered texts) may run.

    Returns
    -------
    One sentence on what the user may not expect: Python in the file was not run, or there is no file; else None.

    Raises
    ------
    Problem
        If the file can't be opened, or scripts are to be allowed in one that Blender has opened without them.
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
        return "no .blend is given or open, so this is about the scene that Blender starts with"
    if not bpy.app.autoexec_fail:
        return None
    skipped = f"file '{blend or opened}': Python in it was not run ({bpy.app.autoexec_fail_message})"
    if path != opened:
        return f"{skipped}; if you trust the file, allow it with --allow-scripts"
    cure = "if you trust the file, start Blender with --enable-autoexec"
    if allow_scripts:
        raise Problem(f"{skipped} when Blender opened it, before --allow-scripts was read; {cure}")
    return f"{skipped}; {cure}"


def save_blend(path: Path) -> None:
    """Write what is open in Blender into a file, and keep earlier versions of it as Blender's preferences say.

    Raises
    ------
    WriteError
        Naming the file; an earlier one stays as it was.
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
    """Whether a .blend has its end. Blender reports no error where it writes a compressed one to a full disk."""
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
    """Blender's reason, and what often is the real one: it reads the system's error number too late."""
    return f"{text}; {shutil.disk_usage(folder).free / 1e6:.3g} MB are free in its folder"


def _keep_versions(path: Path) -> None:
    """NAME.blend becomes NAME.blend1, that NAME.blend2 …: what Blender does itself when it saves over a file."""
    for number in range(bpy.context.preferences.filepaths.save_version, 0, -1):
        earlier = path.with_name(f"{path.name}{number - 1 or ''}")
        later = path.with_name(f"{path.name}{number}")
        if not earlier.exists() or (later.exists() and later.samefile(earlier)):
            continue
        with replacing(later) as temporary:
            try:
                temporary.hardlink_to(earlier)  # takes no space, and `path` is never missing
            except OSError:  # a file system without hard links
                shutil.copy2(earlier, temporary)
