"""MATLAB objects, which hold no plain array: tables, timetables, durations, strings."""

from pathlib import Path


def matlab_object(file: Path, path: str) -> ValueError:
    """Gives the error for a variable that only MATLAB can read, with what to type there."""
    return ValueError(
        f"{file}: column `{path}` holds objects, a MATLAB table, timetable, datetime or other class, that "
        f"only MATLAB can read; expected arrays. In MATLAB write S = table2struct({path}, 'ToScalar', true); "
        "save('arrays.mat', '-struct', 'S'), of a timetable after timetable2table; or writetable to .csv"
    )
