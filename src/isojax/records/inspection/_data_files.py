"""Which of the files that a person names are records, and which are schedules of stepped sines."""

import os
from collections.abc import Sequence
from pathlib import Path

from ..formats import door, read_table, split_heading
from ..reading import READERS, find_reader
from ..reading import SCHEDULE_HEADINGS as _SCHEDULE


def find_data_files(paths: Sequence[str | Path]) -> tuple[list[Path], dict[Path, Path]]:
    """Gives the data files among files and folders, and the schedules that belong to them.

    Of a folder all files count whose ending a reader knows. A schedule has the headings start_s, frequency_hz
    and cycles; it belongs to the data file with whose stem its own begins.

    Args:
        paths: Files and folders, in the order of the test; a folder in the order of its names.

    Returns:
        Data files, and the schedule of each that has one.

    Raises:
        ValueError: If a file is missing or of an unknown ending, or if none is left.
    """
    files: list[Path] = []
    for path in map(Path, paths):
        found = [path]
        if os.path.isdir(path):
            found = sorted(one for one in path.iterdir() if one.is_file() and one.suffix.lower() in READERS)
        for file in found:
            find_reader(file)
        files += found
    schedules = [file for file in files if _is_schedule(file)]
    data = [file for file in files if file not in schedules]
    if not data:
        raise ValueError(f"{', '.join(map(str, paths))}: no data file; expected one of {', '.join(READERS)}")
    belongs: dict[Path, Path] = {}
    for schedule in schedules:
        near = [one for one in data if schedule.stem.startswith(one.stem) and schedule.parent == one.parent]
        if near:
            belongs[max(near, key=lambda one: len(one.stem))] = schedule
    return data, belongs


def _is_schedule(file: Path) -> bool:
    if file.suffix.lower() != ".csv":
        return False
    try:
        with door(file, "a table"):
            headings = [split_heading(one)[0] for one in read_table(file).headings]
    except ValueError:
        return False
    return set(_SCHEDULE) <= set(headings)
