"""What names and units say of channels: what each measures, which is the time, the drive, the response."""

import re
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from ..formats import channel_unit
from ._channel import ChannelInspection

_WORDS: Mapping[str, str] = {
    "force": r"force|load|kraft|loadcell|lc|f|fx|fy|fz|n",
    "acceleration": r"acc|accel|acceleration\w*|beschl\w*|a|ax|ay|az|g|xdd|ydd|zdd",
    "velocity": r"vel|velocity|geschw\w*|speed|v|vx|vy|vz|geophone|xd|yd|zd",
    "displacement": r"disp|displ|displacement|pos|position|weg|laser|lvdt|encoder|x|y|z|qm",
    "command": r"command|cmd|drive|voltage|volt|u|input|exc|excitation|ref|signal",
}
"""Names of channels by what they measure, sought in this order among the words of a name."""

_TIME = re.compile(r"t|time|times|zeit|x_value|index|timestamp|sec|seconds|time_?s", re.IGNORECASE)
_NAMELESS = re.compile(r".*\[(:, *\d+|\d+, *:)\]")
_UNEVEN = 0.5
"""Share of the usual step by which steps of a nameless time may differ: it may be rounded."""

_BASE = re.compile(r"base|floor|ground|table|shaker|fuss|boden|foot", re.IGNORECASE)
_MOVING = re.compile(r"react\w*|exciter|moving|armature", re.IGNORECASE)
_DRIVES = ("force", "command")
_OUTPUTS = ("acceleration", "velocity", "displacement")


def guess_quantity(name: str, unit: str | None) -> str | None:
    """Gives what a channel measures: by its unit, else by a word of its name, else None."""
    measured = None if unit is None else channel_unit(unit)
    if measured is not None and measured.quantity in ("force", *_OUTPUTS):
        return measured.quantity
    if measured is not None and measured.quantity == "current":
        return "command"
    words = [word for word in re.split(r"[^A-Za-z]+", name) if word]
    # "V1" is a voltage, "v" a velocity.
    words = ["voltage" if word == "V" else word.lower() for word in words]
    for quantity, pattern in _WORDS.items():
        if any(re.fullmatch(pattern, word) for word in words):
            return quantity
    return "command" if measured is not None and measured.quantity == "voltage" else None


def is_time(name: str, unit: str | None, samples: Float[np.ndarray, " time"]) -> bool:
    """Whether a column is the time: by its unit or its name, and mostly increasing; nameless, evenly."""
    if samples.size < 2:
        return False
    steps = np.diff(samples)
    if is_nameless(name):
        usual = float(np.median(steps))
        return bool(usual > 0.0 and np.max(np.abs(steps - usual)) < _UNEVEN * usual)
    measured = None if unit is None else channel_unit(unit)
    last = re.split(r"[./]", name.strip())[-1]
    called = _TIME.fullmatch(last) is not None if measured is None else measured.quantity == "time"
    return bool(called and np.mean(steps > 0.0) > 0.9)


def is_nameless(name: str) -> bool:
    """Whether a channel has no name of its own, but a place in an array, such as "data[:, 0]"."""
    return _NAMELESS.fullmatch(name.strip()) is not None


def drive_and_response(
    channels: Sequence[ChannelInspection],
) -> tuple[ChannelInspection | None, ChannelInspection | None]:
    """Gives the channel that drives and the one that responds, as far as names and units show.

    The drive is a force or command, else the acceleration of a base or an exciter, else the first channel.
    The response is an acceleration, else a velocity, else a displacement, else the first that is left.
    """
    moving = [one for one in channels if one.rms > 0.0] or list(channels)
    drive = next((one for quantity in _DRIVES for one in moving if one.quantity == quantity), None)
    if drive is None:
        drive = next((one for one in moving if is_base(one.name) or is_exciter(one.name)), None)
    if drive is None and moving:
        drive = next((one for one in moving if one.quantity is None), moving[0])
    rest = [one for one in moving if one is not drive]
    found = (one for quantity in (*_OUTPUTS, None) for one in rest if one.quantity == quantity)
    response = next((one for one in found if not is_base(one.name)), None)
    return drive, response or next(iter(rest), None)


def is_base(name: str) -> bool:
    """Whether a name is that of something under the isolator."""
    return _BASE.search(name) is not None


def is_exciter(name: str) -> bool:
    """Whether a name is that of the moving mass of an exciter."""
    return _MOVING.search(name) is not None
