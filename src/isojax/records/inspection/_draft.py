"""A campaign.toml drafted from inspected files, with every guess marked."""

import os
from collections.abc import Sequence
from pathlib import Path

from ..._languages import as_toml, printable
from .._campaign import OutputQuantity
from ..formats import channel_unit, split_heading
from ..reading import MOST_JITTER
from ._arrangement import Place, arrange
from ._channel import ChannelInspection
from ._guess import is_base, is_exciter, is_nameless
from ._inertia_of_records import guess_mass
from ._inspect_file import FileInspection

_SI = {"force": "N", "acceleration": "m/s^2", "velocity": "m/s", "displacement": "m", "command": "V"}


def draft_campaign(
    files: Sequence[FileInspection], folder: str | Path, schedules: dict[Path, Path] | None = None
) -> str:
    """Gives the text of a campaign.toml for inspected files; a comment `# guessed: ...` marks each guess.

    What a person must say is guessed as well, so that `read_campaign` accepts the draft: the mass from the
    inertia in the records, the quantities from names and units, levels and roles from names and drives.

    Args:
        files: Inspections, in the order of the test.
        folder: Where the campaign.toml will stand; paths in it are relative to that.
        schedules: The schedule of a stepped sine, by data file.

    Returns:
        The text.

    Raises:
        ValueError: If there is no file, a file has one channel only, its rate is not known, or the files do
            not have the same drive and response.
    """
    if not files:
        raise ValueError("Argument `files` must hold at least one inspected file, but is empty.")
    first = files[0]
    drive, response = _agreed(files)
    base = drive.quantity == "acceleration" and not is_exciter(drive.name)
    title = Path(folder).resolve().name
    lines = [
        "# Drafted from the data files. Check every line that says `guessed`, and delete the remark.",
        "",
        "[campaign]",
        f"title = {as_toml(title)}",
        _mass_line(files, drive, response),
        "",
        "[input]",
        *_input_lines(drive, base),
        "",
        "[output]",
        *_output_lines(response),
        "",
        "[sampling]",
        *_sampling_lines(first),
        "",
        "[model]",
        'stiffness = ["linear"]      # guessed: write what you believe acts, the loop reports more',
        'damping = ["linear"]',
    ]
    for file, place in zip(files, arrange(files), strict=True):
        lines += [
            "",
            "[[record]]",
            *_record_lines(file, place, Path(folder), (schedules or {}).get(file.file)),
        ]
    return "\n".join(lines) + "\n"


def _agreed(files: Sequence[FileInspection]) -> tuple[ChannelInspection, ChannelInspection]:
    first = files[0]
    for file in files:
        if file.drive is None or file.response is None:
            held = ", ".join(f"`{one.name}`" for one in file.channels)
            raise ValueError(
                f"{file.file} has the channel {held} only; a record needs a drive and a response"
            )
        if file.rate is None:
            raise ValueError(
                f"{file.file} does not state its sampling rate, and it has no time column; give it: --rate HZ"
            )
        if (file.drive, file.response) != (first.drive, first.response):
            raise ValueError(
                f"{file.file} seems to have the drive `{file.drive}` and the response `{file.response}`, but "
                f"{first.file} `{first.drive}` and `{first.response}`; draft a campaign of files alike"
            )
    drive, response = first.channel(first.drive), first.channel(first.response)
    if drive is None or response is None:
        raise ValueError(f"{first.file} has no drive or no response")
    return drive, response


def _mass_line(files: Sequence[FileInspection], drive: ChannelInspection, response: ChannelInspection) -> str:
    quantity = _output_quantity(response)
    units = [channel_unit(one.unit or _SI[kind]) for one, kind in ((drive, "force"), (response, quantity))]
    if drive.quantity == "force" and all(units):
        force, motion = (1.0 if one is None else one.factor for one in units)
        found = []
        for file in files:
            pushed, moved = file.channel(file.drive), file.channel(file.response)
            if pushed is None or moved is None or pushed.missing or moved.missing or file.rate is None:
                continue
            found.append(guess_mass(force * pushed.samples, motion * moved.samples, file.rate, quantity))
        masses = sorted(one for one in found if one is not None)
        if masses:
            middle = masses[len(masses) // 2]
            return f"mass = {middle:.3g}      # guessed: kg, from force over acceleration; weigh it"
    return "mass = 1.0      # guessed: kg; nothing in the files shows it; weigh it"


def _output_quantity(response: ChannelInspection) -> OutputQuantity:
    match response.quantity:
        case "velocity":
            return "velocity"
        case "displacement":
            return "displacement"
        case _:
            return "acceleration"


def _input_lines(drive: ChannelInspection, base: bool) -> list[str]:
    quantity, why, more = drive.quantity, "", []
    if quantity == "acceleration" and base:
        quantity = "base_acceleration"
        why = "# guessed: " + ("the name" if is_base(drive.name) else "no force among the channels")
    elif quantity == "acceleration":
        quantity, why = "reaction_mass_acceleration", "# guessed: the name"
        more = ["moving_mass = 1.0      # guessed: kg of the exciter; write the weighed mass"]
    elif quantity not in ("force", "command"):
        quantity, why = "command", "# guessed: neither name nor unit says what drives"
        more = ["gain = 1.0      # guessed: N per unit of the column"]
    elif quantity == "command":
        why = "# guessed: name or unit"
        more = ["gain = 1.0      # guessed: N per SI unit of the column"]
    else:
        why = _reason(drive)
    kind = "acceleration" if quantity.endswith("acceleration") else quantity
    return [_field("quantity", quantity, why), f"column = {_column(drive)}", _unit_line(drive, kind), *more]


def _output_lines(response: ChannelInspection) -> list[str]:
    quantity = _output_quantity(response)
    why = "# guessed: nothing says" if response.quantity != quantity else _reason(response)
    return [
        _field("quantity", quantity, why),
        f"column = {_column(response)}",
        _unit_line(response, quantity),
    ]


def _reason(channel: ChannelInspection) -> str:
    return "" if _stated(channel.unit) else "# guessed: the name"


def _stated(unit: str | None) -> bool:
    return unit is not None and channel_unit(unit) is not None


def _unit_line(channel: ChannelInspection, quantity: str) -> str:
    if channel.unit is not None and _stated(channel.unit):
        return _field("unit", channel.unit, "")
    said = "none" if channel.unit is None else f'"{channel.unit}"'
    return _field("unit", _SI[quantity], f"# guessed: the file states {said}")


def _sampling_lines(file: FileInspection) -> list[str]:
    lines = [f"rate = {file.rate!r}      # from: {printable(file.rate_from)}"]
    if file.time is not None and not file.time_fault:
        guessed = "# guessed: it increases evenly" if is_nameless(file.time) else ""
        lines.append(_field("time", split_heading(file.time)[0], guessed))
        if file.time_unit is not None or guessed:
            lines.append(_field("unit", file.time_unit or "s", guessed and "# guessed"))
        if file.time_jitter * (file.rate or 0.0) > MOST_JITTER:
            lines.append("resample = true      # guessed: the samples were taken when their times say")
    elif file.time is not None:
        lines.append(f"# the time column is not used: {printable(file.time_fault)}")
    return lines


def _record_lines(file: FileInspection, place: Place, folder: Path, schedule: Path | None) -> list[str]:
    lines = [f"file = {as_toml(_relative(file.file, folder))}"]
    if schedule is not None:
        lines.append(f"schedule = {as_toml(_relative(schedule, folder))}")
    elif file.dwells:
        low, high = min(one.frequency for one in file.dwells), max(one.frequency for one in file.dwells)
        lines.append(f"# guessed: stepped sine, {len(file.dwells)} dwells from {low:.4g} to {high:.4g} Hz")
    elif file.kind is not None and file.period is None:
        lines.append(f"# guessed: {file.kind.replace('_', ' ')}")
    if file.period is not None:
        lines.append(f"period = {file.period}      # guessed: samples, the input repeats itself")
    lines.append(f"level = {place.level!r}      # guessed: {printable(place.level_from)}")
    if place.direction != "none":
        lines.append(_field("direction", place.direction, f"# guessed: {place.direction_from}"))
    lines.append(_field("role", place.role, f"# guessed: {place.role_from}"))
    return lines


def _relative(file: Path, folder: Path) -> str:
    return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()


def _column(channel: ChannelInspection) -> str:
    return as_toml(channel.name)


def _field(name: str, value: str, remark: str) -> str:
    return f"{name} = {as_toml(value)}" + (f"      {printable(remark)}" if remark else "")
