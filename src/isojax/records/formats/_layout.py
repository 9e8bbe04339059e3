"""Where the table is in a sheet of cells: free lines, heading, row of units, rows of numbers."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from ._heading import bare_unit, split_heading
from ._samples import Column, find_channel

_NO_UNIT = ("", "-", "--", "1")
"""Cells of a row of units above a column that has none."""


@dataclass(frozen=True)
class Layout:
    """Parts of a sheet of cells.

    Attributes:
        first: Row of the first values.
        width: Columns of values.
        headings: One a column; "[:, 0]", "[:, 1]", ... where the sheet has none.
        units: One a column, from the row of units or from the heading, or None.
    """

    first: int
    width: int
    headings: tuple[str, ...]
    units: tuple[str | None, ...]


def numeric_cells(
    rows: Sequence[Sequence[str]], is_number: Callable[[str], bool]
) -> tuple[int, list[np.ndarray]]:
    """Gives how many columns the rows of numbers have, and for each row which cells are numbers.

    Args:
        rows: Cells, without the empty ones at the end of a row.
        is_number: Whether a cell is a number.

    Returns:
        The number of columns of most rows with a number, 0 where there is none; one array a row.
    """
    which = [np.array([is_number(cell) for cell in row], dtype=bool) for row in rows]
    votes: Counter[int] = Counter()
    for flags in which:
        votes[flags.size] += int(np.any(flags))
    width = max(votes, key=lambda size: votes[size], default=0)
    return (width if votes[width] else 0), which


def find_layout(
    rows: Sequence[Sequence[str]],
    is_number: Callable[[str], bool],
    divide: Callable[[int, int], Sequence[str]] | None = None,
) -> Layout | None:
    """Gives where the table is in the first rows of a sheet.

    The heading is the last row above the numbers; where that one holds units only, the row above it.

    Args:
        rows: Cells, without the empty ones at the end of a row.
        is_number: Whether a cell is a number.
        divide: Gives the cells of a row of text again, for so many columns; a heading may be separated in
            another way than its numbers.

    Returns:
        The layout, or None where no row holds a number.
    """
    width, which = numeric_cells(rows, is_number)
    if width == 0:
        return None
    first = _first_row(rows, which, width)
    places = range(first - 1, max(first - 4, -1), -1)
    above: list[Sequence[str]] = [rows[i] if divide is None else divide(i, width) for i in places]
    units: list[str | None] = [None] * width
    # A row of remarks may stand between the units and the numbers.
    for i in range(min(2, len(above) - 1)):
        if len(above[i + 1]) == width and _are_units(above[i], width):
            units = [bare_unit(cell) for cell in [*above[i], *[""] * width][:width]]
            above = above[i + 1 :]
            break
    if not above or (len(above[0]) < 2 <= width):
        headings = [f"[:, {i}]" for i in range(width)]
    else:
        headings = [cell.strip() for cell in above[0]]
        units += [None] * (len(headings) - width)
    stated = [own or split_heading(heading)[1] for heading, own in zip(headings, units, strict=False)]
    return Layout(first, width, tuple(headings), tuple(stated))


def pick_columns(
    file: Path,
    names: Sequence[str] | None,
    headings: Sequence[str],
    column: Callable[[int], Column],
    groups: Sequence[str] | None = None,
) -> dict[str, Column]:
    """Gives the columns of a table by their headings.

    Args:
        file: For the error.
        names: Headings, with or without the unit in them; None for all columns that hold numbers.
        headings: All of them.
        column: Gives a column by its place.
        groups: Name of the table that each heading belongs to, where there are several.

    Returns:
        Name to column.

    Raises:
        ValueError: If a heading is missing or not unique, or a column holds no numbers.
    """
    known = [list(dict.fromkeys([heading, split_heading(heading)[0]])) for heading in headings]
    if groups is not None:
        known = [
            [f"{group}/{own[0]}", *own, *(f"{group}/{one}" for one in own[1:])]
            for group, own in zip(groups, known, strict=True)
        ]
    if names is not None:
        return {name: column(find_channel(file, name, known)) for name in names}
    held = {}
    for i, own in enumerate(known):
        unique = next((one for one in (own[1:2] or own) if sum(one in other for other in known) == 1), own[0])
        try:
            held[unique if groups is not None else own[0]] = column(i)
        except ValueError:
            continue  # a column of text, or an empty one, is no channel
    return held


def _first_row(rows: Sequence[Sequence[str]], which: Sequence[np.ndarray], width: int) -> int:
    """Gives the row in which the values start; a cell of it may be empty or, by mistake, hold a text."""
    full = [flags for flags in which if flags.size == width]
    usual = np.mean(full, axis=0) > 0.5
    usual = usual if np.any(usual) else np.any(full, axis=0)
    good = [i for i, flags in enumerate(which) if flags.size == width and np.all(flags[usual])]
    first = good[0] if good else next(i for i, one in enumerate(which) if one.size == width and np.any(one))
    while first and np.any(which[first - 1]) and _only_numbers(rows[first - 1], which[first - 1]):
        first -= 1
    # A row with text in it belongs to the values if a row of text alone stands above it.
    for i in range(first - 1, 0, -1):
        if which[i].size != width or not np.any(which[i]):
            break
        if which[i - 1].size == width and not np.any(which[i - 1]):
            return i
    return first


def _only_numbers(cells: Sequence[str], flags: Bool[np.ndarray, " column"]) -> bool:
    return all(flag or not cell.strip() for cell, flag in zip(cells, flags, strict=True))


def _are_units(cells: Sequence[str], width: int) -> bool:
    """Whether the cells are units or nothing; other words are allowed where most cells are units."""
    found = sum(bare_unit(cell) is not None for cell in cells)
    nothing = sum(cell.strip() in _NO_UNIT for cell in cells)
    return len(cells) <= width and 0 < found and (found + nothing == len(cells) or found >= 0.5 * len(cells))
