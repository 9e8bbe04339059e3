"""Levels, directions and roles of records, guessed from file names and from the drive."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .._record import Direction, Role
from ._inspect_file import FileInspection

_NUMBER = r"(\d+(?:[.p]\d+)?)"
_LEVEL = re.compile(
    rf"(?:level|lvl|niveau|amp)[ _-]?{_NUMBER}|(?<![A-Za-z\d.]){_NUMBER} ?(?:N|mN|kN|g|V|mV)(?![a-z])",
    re.IGNORECASE,
)
_FORWARD = re.compile(r"up|fwd|forwards?|auf|rising|ascending", re.IGNORECASE)
_BACKWARD = re.compile(r"down|dn|bwd|backwards?|ab|falling|descending", re.IGNORECASE)

_SAME_LEVEL = 0.08
"""Relative difference of the drives' rms within which two records have one level."""

_THIRD = 3


class Place(NamedTuple):
    """What a record is in its campaign, and why.

    Attributes:
        level: Its excitation level.
        level_from: Where that comes from, in words.
        direction: Direction of its sine.
        direction_from: Where that comes from, in words.
        role: Its role.
        role_from: Why, in words.
    """

    level: float
    level_from: str
    direction: Direction
    direction_from: str
    role: Role
    role_from: str


def arrange(files: Sequence[FileInspection]) -> list[Place]:
    """Gives level, direction and role of each record.

    Of three levels or more one in the middle is held out: a finding must predict a level that its refit has
    not seen, and the model is not asked beyond what it was fitted to. Else every third record is held out,
    and none of fewer than three.
    """
    levels, level_from = _levels(files)
    distinct = sorted(set(levels))
    places = []
    for i, file in enumerate(files):
        direction, direction_from = _direction(file)
        role: Role = "fit"
        if len(distinct) >= _THIRD:
            held = levels[i] == distinct[len(distinct) // 2]
            why = f"one level of {len(distinct)} between the others is held out"
        else:
            held = len(files) >= _THIRD and i % _THIRD == _THIRD - 1
            why = (
                "every third record is held out"
                if len(files) >= _THIRD
                else "too few records to hold one out"
            )
        role = "holdout" if held else "fit"
        places.append(Place(levels[i], level_from, direction, direction_from, role, why))
    return places


def _levels(files: Sequence[FileInspection]) -> tuple[list[float], str]:
    named = [_LEVEL.search(file.file.stem) for file in files]
    if all(named):
        numbers = [next(text for text in match.groups() if text) for match in named if match]
        return [float(text.lower().replace("p", ".")) for text in numbers], "the file's name"
    sizes = np.array([_size(file) for file in files])
    levels = np.zeros(sizes.size)
    for i in np.argsort(sizes):
        near = [one for one in levels if one > 0.0 and abs(sizes[i] / one - 1.0) < _SAME_LEVEL]
        levels[i] = near[0] if near else max(sizes[i], 1e-300)
    return [float(f"{one:.3g}") for one in levels], "the rms of the drive"


def _size(file: FileInspection) -> float:
    drive = file.channel(file.drive)
    return 0.0 if drive is None else float(drive.rms)


def _direction(file: FileInspection) -> tuple[Direction, str]:
    if file.direction != "none":
        return file.direction, "the frequencies"
    if file.kind in ("stepped_sine", "swept"):
        for word in re.split(r"[^A-Za-z]+", file.file.stem):
            if _FORWARD.fullmatch(word):
                return "forward", "the file's name"
            if _BACKWARD.fullmatch(word):
                return "backward", "the file's name"
    return "none", ""
