"""The folder that a run fills: tried before the work, held by one run, and never with files of two runs.

What isojax needs there for itself is in the hidden folder `.isojax`: the lock, the names of the files that
isojax wrote, what an unfinished run keeps. It lies inside, so that moving a file in is one rename even where
the folder is a mounted disk or the folder above it is read-only.
"""

import contextlib
import errno
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path

import filelock

_ROOM = ".isojax"
_WRITTEN = "written.json"
_PROBE = 65536
"""Bytes that must fit before the work begins."""


class KeptElsewhereError(OSError):
    """Results that could not be written where they were asked for, and the folder that has them."""


def kept_file(folder: str | Path) -> Path:
    """Give the file in which an unfinished run into a folder keeps its answers.

    Args:
        folder: the output folder.

    Returns:
        Its path.
    """
    return Path(folder) / _ROOM / "answers"


def check_folder(folder: str | Path) -> Path:
    """Refuse a path that can be no folder; nothing is made yet.

    Args:
        folder: where results shall go.

    Returns:
        Its path.

    Raises:
        ValueError: if something else than a folder is in the way.
    """
    folder = Path(folder)
    for part in (folder, *folder.parents):
        if part.exists() and not part.is_dir():
            raise ValueError(f"{folder} must be a folder, but {part} is a file.")
    nearest = next(part for part in (folder, *folder.absolute().parents) if part.exists())
    if not os.access(nearest, os.W_OK):
        raise ValueError(f"{folder} cannot be written to ({os.strerror(errno.EACCES)}).")
    return folder


@contextmanager
def output_folder(folder: str | Path) -> Iterator[Path]:
    """Make a folder, try to write to it, and hold it until the run is over.

    A run that leaves nothing leaves no folder either. The lock ends with the process that holds it, however
    that ends.

    Args:
        folder: where results shall go.

    Yields:
        Its path.

    Raises:
        ValueError: if something else than a folder is in the way, it cannot be made or written to, or another
            run holds it.
    """
    folder = check_folder(folder)
    room = folder / _ROOM
    made = [part for part in (room, folder, *folder.parents) if not part.exists()]
    try:
        room.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=room) as probe:
            probe.write(bytes(_PROBE))
        lock = filelock.FileLock(room / "lock", timeout=0)
        try:
            lock.acquire()
        except filelock.Timeout:
            raise ValueError(
                f"{folder} is in use by another run of isojax: wait for its end, or give another folder."
            ) from None
    except OSError as error:
        _remove_empty(made)
        raise ValueError(f"{folder} cannot be written to ({_reason(error)}).") from None
    try:
        yield folder
    finally:
        if {entry.name for entry in room.iterdir()} <= {"lock"}:
            (room / "lock").unlink(missing_ok=True)
            lock.release()
            _remove_empty([room, *made])
        else:
            lock.release()


def publish(folder: Path, contents: Mapping[str, str | bytes | None], stale: tuple[str, ...] = ()) -> None:
    """Put the files of a run into a folder in place of those of earlier runs.

    All are written beside their places first. Then the files of earlier runs are removed, and the new ones
    are renamed into their places, so that at no moment files of two runs stand together. What isojax did not
    write stays.

    Args:
        folder: where they go; made if it is not there.
        contents: content by file name; None removes what has the name, whoever wrote it.
        stale: patterns of names of further files that go, if isojax wrote them.

    Raises:
        KeptElsewhereError: if they could not be written there; it names the folder that has them.
    """
    room, gone = folder / _ROOM, {name for name, content in contents.items() if content is None}
    contents = {name: content for name, content in contents.items() if content is not None}
    try:
        room.mkdir(parents=True, exist_ok=True)
        fresh = Path(tempfile.mkdtemp(dir=room, prefix="new-"))
    except OSError as error:
        raise _kept_elsewhere(folder, contents, error) from None
    try:
        for name, content in contents.items():
            _write(fresh / name, content)
    except OSError as error:
        shutil.rmtree(fresh, ignore_errors=True)
        raise _kept_elsewhere(folder, contents, error) from None
    try:
        written = _written(room)
        old = gone | {
            name for name in written if name in contents or any(fnmatchcase(name, one) for one in stale)
        }
        for name in old:
            (folder / name).unlink(missing_ok=True)
        _write(room / _WRITTEN, json.dumps(sorted((written - old) | set(contents))) + "\n")
        for name in contents:
            os.replace(fresh / name, folder / name)
        fresh.rmdir()
    except OSError as error:
        raise KeptElsewhereError(
            f"{folder} cannot be written to ({_reason(error)}). The results are in {fresh} and {folder}."
        ) from None


def discard(folder: Path) -> None:
    """Remove what an unfinished run kept in a folder, which is of no more use.

    Args:
        folder: the output folder.
    """
    with contextlib.suppress(OSError):
        kept_file(folder).unlink(missing_ok=True)
    for left in (folder / _ROOM).glob("new-*"):
        shutil.rmtree(left, ignore_errors=True)


def _written(room: Path) -> set[str]:
    """Give the names of the files that isojax wrote."""
    try:
        names = json.loads((room / _WRITTEN).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return set()
    return {name for name in names if isinstance(name, str)} if isinstance(names, list) else set()


def _write(path: Path, content: str | bytes) -> None:
    path.write_bytes(content.encode() if isinstance(content, str) else content)


def _kept_elsewhere(folder: Path, contents: Mapping[str, str | bytes], error: OSError) -> KeptElsewhereError:
    """Write results to another disk, and say where."""
    said = f"{folder} cannot be written to ({_reason(error)})"
    for other in (tempfile.gettempdir(), Path.home()):
        try:
            place = Path(tempfile.mkdtemp(dir=other, prefix="isojax-"))
            for name, content in contents.items():
                _write(place / name, content)
        except OSError:
            continue
        return KeptElsewhereError(f"{said}. The results are in {place}.")
    return KeptElsewhereError(f"{said}, nor can any other folder: the results are lost.")


def _remove_empty(folders: list[Path]) -> None:
    """Remove folders, the innermost first, as far as they are empty."""
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.rmdir()


def _reason(error: OSError) -> str:
    return error.strerror or errno.errorcode.get(error.errno or 0, str(error))
