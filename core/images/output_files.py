"""Output files: checked before the work that makes them, and afterwards either complete or as they were.

A file is written under a temporary name in its own folder, flushed to the disk and renamed. So a full disk, a killed
process or an error of the writer leaves an earlier file of that name whole.
"""

from __future__ import annotations

import contextlib
import errno
import glob
import os
import secrets
import shutil
import stat
from collections.abc import Iterator, Sequence
from pathlib import Path

# How all temporary names begin; the final name isn't part of them, since with it they could get too long.
TEMPORARY = ".edgegrad-"
CANNOT_FLUSH = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP)  # of file systems that know no flushing
PROBE_BYTES = 4096  # a full disk still takes the name of a file, but not its first block


class WriteError(OSError, ValueError):
    """A file that can't be written; its text is one sentence that names the file.

    It is an `OSError`, and a `ValueError` like everything else that `edgegrad.images.write_image` refuses.
    """


def check_outputs(paths: Sequence[str | Path], suffixes: Sequence[str]) -> None:
    """Find out, by trying, whether files can be written.

    Parameters
    ----------
    paths
        The files; they may exist, their folders must.
    suffixes
        The types that may be written, such as ``(".exr", ".png")``.

    Raises
    ------
    WriteError
        Naming the file and the reason.
    """
    tried = set()
    for path in paths:
        suffix = Path(path).suffix
        if suffix.lower() not in suffixes:
            instead = f", not {suffix}" if suffix else ""
            raise WriteError(f"file '{path}': must end in {' or '.join(suffixes)}{instead}")
        with _naming(f"file '{path}': can't be written"):
            folder = _destination(Path(path)).parent
        if folder not in tried:
            with _naming(f"file '{path}': no file can be made in its folder"):
                _try_to_create(folder)
            tried.add(folder)


def check_output_folder(path: str | Path) -> None:
    """Find out, by trying, whether files can be written into a folder, which need not exist yet.

    Raises
    ------
    WriteError
        Naming the folder and the reason.
    """
    with _naming(f"folder '{path}': can't be written to"):
        folder = Path(os.path.realpath(path))
        while not os.path.lexists(folder):
            folder = folder.parent
        if not folder.is_dir():
            raise OSError(f"'{folder}' is not a folder")
        _try_to_create(folder)


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A temporary path beside `path` to write to; takes the place of `path` when the block ends without an error.

    Raises
    ------
    WriteError
        Naming `path`, for an `OSError` of the block, of flushing or of renaming. The temporary file is removed.
    """
    what = f"file '{path}': can't be written"
    with _naming(what):
        final = _destination(Path(path))
        temporary = _unused(final.parent, final.suffix)
        try:
            try:
                yield temporary
            except WriteError:
                raise
            except OSError as error:  # a library names the file that it was given
                raise _refusal(what, error, _reason(error).replace(str(temporary), str(path))) from None
            with contextlib.suppress(OSError):  # file systems without modes
                shutil.copymode(final, temporary)
            with temporary.open("r+b") as file:
                _flush(file.fileno())
            temporary.replace(final)
        except BaseException:
            _remove(temporary)
            raise
    _flush_folder(final.parent)


def _destination(path: Path) -> Path:
    """Where to write, behind symbolic links: renaming onto a link would replace the link."""
    if "\0" in str(path):
        raise OSError("its name contains a null character")
    final = Path(os.path.realpath(path))
    if not final.parent.is_dir():
        raise OSError(f"there is no folder '{path.parent}'")
    try:
        mode = final.stat().st_mode
    except FileNotFoundError:
        return final
    if not stat.S_ISREG(mode):
        raise OSError("it is a folder" if stat.S_ISDIR(mode) else "it is not a regular file")
    # Renaming needs the folder's permission only, and would replace what its owner has protected.
    if not os.access(final, os.W_OK):
        raise OSError("it is write-protected")
    return final


def _try_to_create(folder: Path) -> None:
    probe = _unused(folder, "")
    try:
        with probe.open("xb") as file:
            file.write(bytes(PROBE_BYTES))
            file.flush()
            _flush(file.fileno())
    finally:
        _remove(probe)


def _unused(folder: Path, suffix: str) -> Path:
    return folder / f"{TEMPORARY}{secrets.token_hex(8)}{suffix}"


def _remove(temporary: Path) -> None:
    """Remove the temporary file and what its writer left beside it (Blender writes to NAME@ first)."""
    for left in temporary.parent.glob(glob.escape(temporary.name) + "*"):
        with contextlib.suppress(OSError):
            left.unlink()


def _flush(descriptor: int) -> None:
    """Wait until what was written is on the disk: some systems report only then that there was no space for it."""
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in CANNOT_FLUSH:
            raise


def _flush_folder(folder: Path) -> None:
    """Put the new name on the disk, where a folder can be flushed; else the system does so in its own time."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@contextlib.contextmanager
def _naming(what: str) -> Iterator[None]:
    """Turn any OSError into a `WriteError` that begins with `what`."""
    try:
        yield
    except WriteError:
        raise
    except OSError as error:
        raise _refusal(what, error, _reason(error)) from None


def _refusal(what: str, error: OSError, reason: str) -> WriteError:
    out = WriteError(f"{what} ({reason})")
    out.errno = error.errno
    return out


def _reason(error: OSError) -> str:
    return (error.strerror or str(error)).strip()
