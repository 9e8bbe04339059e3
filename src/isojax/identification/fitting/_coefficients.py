"""The coefficients of a fit: value, standard error and unit, by symbol or by full name."""

import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from ..._show import Row, amount, number, shown


@shown
class Coefficient(NamedTuple):
    """One number of a fitted model.

    Attributes:
        name: as in reports, such as "linear_stiffness.coefficient".
        symbol: letter of the equation, such as "k1".
        value: fitted, or as declared [unit]; NaN where the search failed.
        standard_error: [unit]; NaN where the data do not determine it, and where it was fixed.
        unit: SI unit.
        start: where the search started [unit]; NaN where the coefficient was added on the way.
        fitted: False where it was held.
    """

    name: str
    symbol: str
    value: float
    standard_error: float
    unit: str
    start: float
    fitted: bool

    @property
    def words(self) -> str:
        """Value with standard error and unit."""
        words = amount(self.value, self.unit, self.standard_error)
        if not self.fitted:
            return f"{words} (fixed)"
        if not math.isfinite(self.value):
            return f"not found, in {self.unit}"
        return words if math.isfinite(self.standard_error) else f"{words} (not determined)"

    def _headline(self) -> str:
        return f"{self.name}, {self.symbol} = {self.words}"


@shown
@dataclasses.dataclass(frozen=True, eq=False)
class Coefficients(Mapping[str, Coefficient]):
    """The coefficients of a fit by name: `fit.parameters["k1"].value`.

    A key is the full name, "linear_stiffness.coefficient", or the symbol, "k1", where only one has it.
    Iteration gives the full names.

    Attributes:
        entries: the coefficients in the order of the model.
    """

    entries: tuple[Coefficient, ...]

    def __getitem__(self, key: str) -> Coefficient:
        """Give a coefficient by full name or symbol; a KeyError lists the names that there are."""
        found = [one for one in self.entries if one.name == key]
        found = found or [one for one in self.entries if one.symbol == key]
        if len(found) == 1:
            return found[0]
        if found:
            raise KeyError(f"{key!r} is the symbol of {' and '.join(one.name for one in found)}: name one.")
        known = ", ".join(f"{one.name} ({one.symbol})" for one in self.entries)
        raise KeyError(f"{key!r} is none of the coefficients {known}.")

    def __iter__(self) -> Iterator[str]:
        """Give the full names."""
        return iter(tuple(one.name for one in self.entries))

    def __len__(self) -> int:
        """Count the coefficients."""
        return len(self.entries)

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """Give symbol, value, standard error, unit, start and whether it was fitted, by full name."""
        return {
            one.name: {key: value for key, value in one._asdict().items() if key != "name"}
            for one in self.entries
        }

    def _headline(self) -> str:
        return f"{sum(one.fitted for one in self.entries)} fitted, {len(self)} in all"

    def _rows(self) -> list[Row]:
        return [
            Row(
                one.name,
                one.words,
                one.symbol
                + (f", from {number(one.start)}" if one.fitted and math.isfinite(one.start) else ""),
            )
            for one in self.entries
        ]
