"""What a check of the records against their declaration says."""

from dataclasses import dataclass
from typing import Literal

from ..._show import shown

CheckName = Literal["power", "inertia", "balance", "sizes", "flat tops", "sample times", "single samples"]


@shown
@dataclass(frozen=True)
class Cause:
    """A mistake that explains what was seen.

    Attributes:
        name: Short name, such as "channels swapped".
        words: The mistake in words, without a full stop.
        line: What to change in campaign.toml, or in the data files.
    """

    name: str
    words: str
    line: str


@shown
@dataclass(frozen=True)
class Suspicion:
    """Something in the records that does not agree with their declaration.

    Attributes:
        check: What was checked.
        where: The channels or the record.
        figure: What was found, in words with its number.
        expected: What would be right.
        causes: Likely mistakes, the likeliest first; none where none explains it.
        contradicts: Whether the declaration cannot be right; else it is a doubt.
    """

    check: CheckName
    where: str
    figure: str
    expected: str
    causes: tuple[Cause, ...]
    contradicts: bool

    def __str__(self) -> str:
        """Give it as sentences."""
        likely = " or ".join(f"{one.words} ({one.line})" for one in self.causes)
        told = f"Likely cause: {likely}." if likely else "No single mistake explains it."
        return f"{self.where}: {self.figure}; expected {self.expected}. {told}"
