"""Answers of costly computations, kept in a file as they come: a run that was killed goes on from the last.

A loop is deterministic: it asks the same questions in the same order every time. Each answer is appended to
the file; a later run of the same loop is given these instead of computing, digit for digit, and computes from
the first question that has none. So nothing of the loop's own state is stored, and no stage needs to know.
"""

import dataclasses
import hashlib
import io
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ._progress import Notice, Resumed

_FORMAT = "isojax-answers"

Answer = tuple[np.ndarray, ...]


def recall(question: str, compute: Callable[[], Answer], *inputs: Any) -> Answer:
    """Give an answer: the one that was kept, or what is computed now, which is then kept.

    Args:
        question: what is computed.
        compute: gives the arrays of the answer.
        inputs: what distinguishes this question from others of its name; records need not be among them,
            since what is kept belongs to one campaign.

    Returns:
        The arrays, in C order whether they were kept or computed: sums depend on the order.
    """
    answers = _ANSWERS.get()
    if answers is not None:
        return answers.give(digest(question, *inputs), compute)
    return _in_order(compute())


@contextmanager
def kept_answers(path: Path, identity: Mapping[str, str], progress: Callable[[str], None]) -> Iterator[None]:
    """Keep the answers of the computations inside, and give those that an earlier run kept.

    Args:
        path: the file.
        identity: what the answers belong to, by words for what it is. A file of another identity is begun
            anew.
        progress: hears whose answers are used, or why they are not.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch()
    # Unbuffered: what was written survives the process, however it ends.
    with path.open("r+b", buffering=0) as file:
        held = _read_header(file)
        if held is not None and held != identity:
            other = " and ".join(name for name in identity if held.get(name) != identity[name])
            progress(Notice(f"what was kept belongs to another {other}: beginning anew"))
        if held != identity:
            file.seek(0)
            file.truncate()
            file.write(_header(identity))
        token = _ANSWERS.set(_Answers(file, progress, replaying=held == identity))
        try:
            yield
        finally:
            _ANSWERS.reset(token)


class _Answers:
    """An open file of answers: read from its start, then written to."""

    def __init__(self, file: BinaryIO, progress: Callable[[str], None], replaying: bool):
        """Take the file, which stands behind its header."""
        self._file: BinaryIO | None = file
        self._progress = progress
        self._replaying = replaying
        self._given = 0

    def give(self, key: str, compute: Callable[[], Answer]) -> Answer:
        """Give the next answer."""
        if self._replaying and self._file is not None:
            place = self._file.tell()
            kept = _read_entry(self._file, key)
            if kept is not None:
                self._given += 1
                return kept
            # The end, an entry that was cut short, or another question: from here on all is new.
            self._file.seek(place)
            self._file.truncate()
            self._replaying = False
            self._progress(Resumed(f"{self._given} finished computations were kept: going on from there"))
        answer = _in_order(compute())
        if self._file is not None:
            place = self._file.tell()
            try:
                _write_entry(self._file, key, answer)
            except OSError as error:
                self._progress(Notice(f"nothing more can be kept ({error.strerror}): going on without"))
                self._file.seek(place)
                self._file.truncate()
                self._file = None
        return answer


_ANSWERS: ContextVar[_Answers | None] = ContextVar("answers", default=None)


def _in_order(answer: Answer) -> Answer:
    return tuple(np.array(one, order="C") for one in answer)


def _header(identity: Mapping[str, str]) -> bytes:
    return (json.dumps({"format": _FORMAT, "identity": dict(identity)}) + "\n").encode()


def _read_header(file: BinaryIO) -> dict[str, str] | None:
    """Give the identity of a file; None where it is empty or none of ours."""
    line = bytearray()
    while (byte := file.read(1)) not in (b"", b"\n"):
        line += byte
    try:
        content = json.loads(line)
        return content["identity"] if content["format"] == _FORMAT else None
    except (ValueError, KeyError, TypeError):
        return None


def _write_entry(file: BinaryIO, key: str, answer: Answer) -> None:
    """Append one answer: a line of JSON, then its arrays as .npy."""
    buffer = io.BytesIO()
    for one in answer:
        np.save(buffer, one, allow_pickle=False)
    body = buffer.getvalue()
    label = {"key": key, "arrays": len(answer), "bytes": len(body), "sum": hashlib.sha256(body).hexdigest()}
    content = json.dumps(label).encode() + b"\n" + body
    if file.write(content) != len(content):
        raise OSError(0, "the disk is full")


def _read_entry(file: BinaryIO, key: str) -> Answer | None:
    """Give the next answer if it is whole and answers this question."""
    line = bytearray()
    while (byte := file.read(1)) not in (b"", b"\n"):
        line += byte
    try:
        label = json.loads(line)
        body = file.read(label["bytes"])
        if label["key"] != key or hashlib.sha256(body).hexdigest() != label["sum"]:
            return None
        buffer = io.BytesIO(body)
        return tuple(np.load(buffer, allow_pickle=False) for _ in range(label["arrays"]))
    except (ValueError, KeyError, TypeError):
        return None


def digest(*parts: Any) -> str:
    """Give a short word that distinguishes data, models and settings from others.

    Args:
        parts: numbers, words, arrays, dataclasses, and whatever holds such.

    Returns:
        32 hexadecimal digits. Of a path only the name counts, of a function only its name.
    """
    word = hashlib.sha256()
    _feed(word.update, parts)
    return word.hexdigest()[:32]


def _feed(update: Callable[[bytes], object], part: Any) -> None:
    update(type(part).__name__.encode())
    if isinstance(part, str | bytes | bool | int | float | complex | None):
        update(repr(part).encode())
    elif isinstance(part, Path):
        update(part.name.encode())
    elif isinstance(part, Mapping):
        for key, value in part.items():
            _feed(update, (key, value))
    elif isinstance(part, list | tuple):
        update(str(len(part)).encode())
        for one in part:
            _feed(update, one)
    elif dataclasses.is_dataclass(part):
        # What is no argument, such as an answer that a record keeps for itself, distinguishes nothing.
        for field in dataclasses.fields(part):
            if field.init:
                _feed(update, (field.name, getattr(part, field.name)))
    elif hasattr(part, "dtype"):
        array = np.asarray(part)
        update(f"{array.dtype}{array.shape}".encode())
        update(np.ascontiguousarray(array).tobytes())
    else:
        update(getattr(part, "__qualname__", type(part).__qualname__).encode())


def package_digest() -> str:
    """Give a short word for this very version of isojax, its sources included, and of what computes."""
    word = hashlib.sha256(" ".join(version(name) for name in ("isojax", "jax", "jaxlib", "numpy")).encode())
    root = Path(str(files("isojax")))
    for file in sorted(root.rglob("*.py")):
        word.update(file.read_bytes())
    return word.hexdigest()[:32]
