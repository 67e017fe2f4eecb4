"""Output files: permission checks before long work, and atomic replacement of the file afterwards.

A file is written under a temporary name in its own folder, flushed to the disk and renamed. Therefore a full disk, a
killed process or an error of the writer leaves an earlier file of the same name unchanged.
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

# Prefix of all temporary names. They do not contain the final name, since the result could be too long.
TEMPORARY = ".edgegrad-"
CANNOT_FLUSH = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP)  # raised by file systems without flushing
PROBE_BYTES = 4096  # a full disk may accept the name of a file, but not its first block


class WriteError(OSError, ValueError):
    """Raised if a file can't be written; the message is one sentence that names the file.

    It is an `OSError`, and also a `ValueError`, like all other errors of `edgegrad.images.write_image`.
    """


def check_outputs(paths: Sequence[str | Path], suffixes: Sequence[str]) -> None:
    """Check that files can be written, by creating temporary files in their folders.

    Parameters
    ----------
    paths
        The files. They need not exist, but their folders must.
    suffixes
        The allowed types, such as ``(".exr", ".png")``.

    Raises
    ------
    WriteError
        If a file can't be written; names the file and the reason.
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
            with _naming(f"file '{path}': no file can be created in its folder"):
                _try_to_create(folder)
            tried.add(folder)


def check_output_folder(path: str | Path) -> None:
    """Check that files can be written into a folder, which need not exist yet, by creating a temporary file.

    Raises
    ------
    WriteError
        If no file can be written; names the folder and the reason.
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
    """Yield a temporary path in the folder of `path`; rename it to `path` if the block ends without an error.

    Raises
    ------
    WriteError
        If the block, the flush or the rename raises `OSError`; names `path`. The temporary file is removed.
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
            except OSError as error:  # the library names the temporary file
                raise _refusal(what, error, _reason(error).replace(str(temporary), str(path))) from None
            with contextlib.suppress(OSError):  # file systems without permissions
                shutil.copymode(final, temporary)
            with temporary.open("r+b") as file:
                _flush(file.fileno())
            temporary.replace(final)
        except BaseException:
            _remove(temporary)
            raise
    _flush_folder(final.parent)


def _destination(path: Path) -> Path:
    """Resolve symbolic links: a rename onto a link would replace the link, not its target."""
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
    # A rename needs the permission of the folder only, so it would replace a write-protected file.
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
    """Remove the temporary file and files that its writer left beside it (Blender writes to NAME@ first)."""
    for left in temporary.parent.glob(glob.escape(temporary.name) + "*"):
        with contextlib.suppress(OSError):
            left.unlink()


def _flush(descriptor: int) -> None:
    """Wait until the data is on the disk: some systems report a full disk only then."""
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in CANNOT_FLUSH:
            raise


def _flush_folder(folder: Path) -> None:
    """Flush the renamed entry to the disk, if the system can flush a folder."""
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
