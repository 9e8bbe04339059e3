"""Whether the records can be what is declared: what speaks against it, and the likely mistake."""

import dataclasses
from typing import Literal

import numpy as np

from .._campaign import Campaign
from .._record import Record
from ._clipped_levels import find_clipping
from ._newton_balance import Balance, Rows, find_balance
from ._readings import declared_reading, late_readings, other_readings, rows_read, sign_cause
from ._sizes import rate_cause, scale_causes, sizes_of
from ._stray_samples import find_stray_samples
from ._suspicion import Cause, Suspicion

_CERTAIN = 4.0
"""Standard errors, by the jackknife, from which a figure counts: a chance of 6e-5 each side."""

_WRONG_MASS = 1.5
"""Apparent over declared mass from which the declaration is wrong: masses are weighed to a few per cent,
fixtures add a tenth, and a usual mistake is a factor of 2 at least."""

_FREE_MASS = 10.0
"""The same where mass or gain are to be identified, so that the declared one is a start; then a doubt."""

_FED_BACK = -0.1
"""Power factor below which the drive takes power out of a passive isolator: a tenth of what it moves."""

_FEWEST_RIGHT = 2
"""Records that feed power in, for each that takes it out, from which that one is the odd one."""

_UNBALANCED = 0.25
"""Share of the target left unbalanced from which a mistake is sought, and to which one must bring it. Laws
that the balance lacks leave 0.1 as a rule, the hysteresis of the Bouc-Wen benchmark 0.2."""

_UNRELATED = 0.6
"""The same from which the output hardly follows the input."""

_CLOSES = 1.0 / 3.0
"""A mistake explains what is unbalanced where undoing it leaves at most this share of it ..."""

_EQUAL = 2.0
"""... and no other leaves less by this factor."""

_FARTHEST = 10.0
"""rms displacement [m] that no isolator has."""

_SLOWEST = 0.05
"""Frequency [Hz] below which no isolator is tested; suspensions of seismometers lie above."""

_JITTERED = 1e-3
"""Error of a sample, over the response, that uneven times may make."""

_STRAY = 1e-3
"""rms of spikes, over that of their channel, from which they are named."""

_LAGGED = {"delay": '[model] elements = ["input_delay"]', "clock skew": '[model] elements = ["clock_skew"]'}
"""Mistakes of time, and the line of campaign.toml that declares each as part of the model."""


def find_suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """Gives what in the records does not agree with their declaration; no model is fitted.

    The forces of the driven records to fit are balanced once, `F = m a + springs + dampers`, by linear least
    squares over odd laws that any isolator may have. A passive isolator takes power up; its apparent mass is
    the declared one; and what is unbalanced is small. Where one of these fails, usual mistakes are undone one
    by one, and those are named that make all three right.

    Args:
        campaign: As declared.

    Returns:
        Contradictions first; none where the records can be what is declared.
    """
    if not campaign.records:
        return ()
    declared = (
        campaign.mass,
        campaign.mass_free,
        campaign.input,
        campaign.output,
        campaign.elements,
        campaign.records,
    )
    return campaign.records[0].once(("suspicions", declared), lambda: _find(campaign))


def _find(campaign: Campaign) -> tuple[Suspicion, ...]:
    rows = rows_read(campaign, declared_reading(campaign))
    found = _odd_records(campaign)
    if rows is not None:
        found = found or _balance_suspicions(campaign, rows)
        found += [*_size_suspicions(campaign, rows), *_jitter_suspicions(campaign, rows)]
    # A clipped top that noise leaves for one sample stands alone as well.
    found += find_clipping(campaign) or find_stray_samples(campaign, _STRAY)
    return tuple(sorted(found, key=lambda one: not one.contradicts))


def _declared_mass(campaign: Campaign, based: bool) -> float:
    return 1.0 if based else campaign.mass


def _has_scale(campaign: Campaign) -> bool:
    """Says whether force, motion and mass are all declared, so that their ratio must be right."""
    return not (campaign.mass_free or campaign.input.gain_free or campaign.input.quantity == "command")


def _is_right(campaign: Campaign, one: Balance) -> bool:
    """Says whether a balance is that of a passive isolator of the declared mass."""
    if np.isnan(one.inertia):
        return one.power > -_FED_BACK
    return (
        one.power > 0.0
        and one.inertia > 0.0
        and (not _has_scale(campaign) or 1.0 / _WRONG_MASS < one.inertia < _WRONG_MASS)
    )


def _balance_suspicions(campaign: Campaign, rows: Rows) -> list[Suspicion]:
    """Gives the one figure of the balance that speaks most clearly, with its causes."""
    reading = declared_reading(campaign)
    balance = find_balance(rows, _declared_mass(campaign, reading.based))
    check = _failed_check(campaign, balance)
    if check is None:
        return []
    causes = _causes(campaign, rows, balance)
    if causes and any(f'"{name}"' in causes[0].line for name in campaign.elements):
        return []
    if not causes and check == "inertia" and balance.unexplained > _UNBALANCED:
        check = "balance"  # noise in the response makes the apparent mass too small
    if not causes and check == "balance" and balance.unexplained < _UNRELATED:
        return []
    # Where the forces balance and no mistake explains it, motions that ring on give back power at times.
    balanced = balance.unexplained < _UNBALANCED
    certain = bool(causes) or (check == "inertia" if balanced else check == "power")
    trusted = campaign.input.quantity != "command" or check == "balance"
    figure, expected = _figure(campaign, check, balance)
    free = check == "inertia" and balance.inertia > 0.0 and not _has_scale(campaign)
    where = f'"{campaign.input.column}" and "{campaign.output.column}"'
    return [Suspicion(check, where, figure, expected, causes, certain and trusted and not free)]


def _odd_records(campaign: Campaign) -> list[Suspicion]:
    """Gives the records, held-out ones as well, that have the sign of one channel against most others.

    The balance of all records may not show them: the others outvote them. Alone, such a record takes power
    out and has a negative mass; a delay, which may do the one, does not do the other.
    """
    reading = declared_reading(campaign)
    balances: dict[str, Balance] = {}
    for record in campaign.records:
        rows = rows_read(dataclasses.replace(campaign, records=(_to_fit(record),)), reading)
        if rows is not None:
            balances[record.name] = find_balance(rows, _declared_mass(campaign, reading.based))
    odd = [
        name
        for name, one in balances.items()
        if _takes_power_out(one) and one.inertia + _CERTAIN * one.inertia_error < 0.0
    ]
    fed = [one for one in balances.values() if one.power > _CERTAIN * one.power_error]
    if len(fed) < _FEWEST_RIGHT * len(odd):
        return []
    cause = Cause(
        "sign of one record",
        "one of its channels has the wrong sign",
        "mend this file; the other records have the declared sign",
    )
    expected = "a power factor above 0, as in the other records"
    certain = campaign.input.quantity != "command"
    return [
        Suspicion("power", name, _power_figure(balances[name]), expected, (cause,), certain) for name in odd
    ]


def _to_fit(record: Record) -> Record:
    return record if record.role == "fit" else dataclasses.replace(record, role="fit")


def _takes_power_out(balance: Balance) -> bool:
    return balance.power < _FED_BACK and balance.power + _CERTAIN * balance.power_error < 0.0


def _power_figure(balance: Balance) -> str:
    return (
        f"the drive takes power out of the isolator (power factor {balance.power:.2f} "
        f"± {balance.power_error:.1g})"
    )


def _failed_check(campaign: Campaign, balance: Balance) -> Literal["power", "inertia", "balance"] | None:
    if _takes_power_out(balance):
        return "power"
    if not np.isnan(balance.inertia) and campaign.input.quantity != "command":
        factor = _WRONG_MASS if _has_scale(campaign) else _FREE_MASS
        reach = _CERTAIN * balance.inertia_error
        if balance.inertia - reach > factor or balance.inertia + reach < 1.0 / factor:
            return "inertia"
    return "balance" if balance.unexplained > _UNBALANCED else None


def _figure(campaign: Campaign, check: str, balance: Balance) -> tuple[str, str]:
    if check == "power":
        return (
            _power_figure(balance),
            "a power factor above 0: a passive isolator absorbs power",
        )
    if check == "inertia":
        based = campaign.input.quantity == "base_acceleration"
        seen = f"{balance.inertia:.3g} ± {balance.inertia_error:.1g} times"
        if based:
            return f"the inertia seen is {seen} that of the declared motion", "1 within a factor of 1.5"
        return (
            f"the apparent mass, force over acceleration, is {balance.inertia * campaign.mass:.3g} kg, "
            f"{seen} the declared one",
            f"{campaign.mass:g} kg within a factor of 1.5",
        )
    return (
        f"springs, dampers and inertia leave {100.0 * balance.unexplained:.0f} % of the force unbalanced",
        "a small part",
    )


def _causes(campaign: Campaign, rows: Rows, balance: Balance) -> tuple[Cause, ...]:
    """Gives the mistakes that make everything right when undone, the likeliest first; two at most."""
    tried: list[tuple[float, tuple[Cause, ...]]] = []
    mirrored = dataclasses.replace(balance, inertia=-balance.inertia, power=-balance.power)
    if balance.unexplained < _UNBALANCED and declared_reading(campaign).has_inertia:
        if _is_right(campaign, mirrored):
            tried.append((balance.unexplained, (sign_cause(campaign),)))
        if balance.inertia > 0.0 and balance.power > 0.0:
            scaled = scale_causes(campaign, sizes_of(campaign, rows), balance.inertia)
            tried.append((balance.unexplained, scaled))
    for reading, cause in other_readings(campaign):
        other = rows_read(campaign, reading)
        if other is not None:
            one = find_balance(other, _declared_mass(campaign, reading.based))
            if _is_right(campaign, one):
                tried.append((one.unexplained, (cause,)))
    for reading in late_readings(campaign):
        name, factor = ("clock skew", reading.skew) if reading.skew else ("delay", reading.delay)
        other = rows_read(campaign, reading)
        if other is not None:
            one = find_balance(other, _declared_mass(campaign, reading.based))
            if _is_right(campaign, one) and one.unexplained < _CLOSES * balance.unexplained:
                if 0.0 < abs(reading.delay) * campaign.rate < 1.0:
                    return ()  # how the drive is held between two samples, which the model may lack
                tried.append((one.unexplained, (_lag_cause(campaign, name, factor),)))
    best = min((unexplained for unexplained, _ in tried), default=np.inf)
    if best > max(_CLOSES * balance.unexplained, _UNBALANCED):
        return ()
    near = sorted((pair for pair in tried if pair[0] <= _EQUAL * best), key=lambda pair: pair[0])
    return tuple(cause for _, causes in near for cause in causes)[:2]


def _lag_cause(campaign: Campaign, name: str, factor: float) -> Cause:
    late = campaign.input.column if factor > 0.0 else campaign.output.column
    if name == "delay":
        words = f'"{late}" is recorded {1e3 * abs(factor):.3g} ms late'
        line = f"shift it by {abs(factor) * campaign.rate:.3g} samples in the data files"
    else:
        words = f"the clocks of the channels differ by {1e6 * abs(factor):.3g} ppm"
        line = "resample one channel, or record both with one clock"
    return Cause(name, words, f"{line}; a small one: {_LAGGED[name]}")


def _size_suspicions(campaign: Campaign, rows: Rows) -> list[Suspicion]:
    """Gives sizes that no bench has, where nothing else speaks: a rate may be wrong without a trace."""
    if campaign.input.quantity == "command" or "V" in campaign.output.unit:
        return []
    sizes = sizes_of(campaign, rows)
    if sizes.displacement <= _FARTHEST and sizes.frequency >= _SLOWEST:
        return []
    figure = f"the motion is {sizes.displacement:.3g} m rms at {sizes.frequency:.3g} Hz"
    expected = f"less than {_FARTHEST:g} m, at more than {_SLOWEST:g} Hz"
    causes = (rate_cause(campaign, 1e3),) if sizes.frequency < _SLOWEST else ()
    certain = sizes.displacement > _FARTHEST
    return [Suspicion("sizes", "sampling", figure, expected, causes, certain)]


def _jitter_suspicions(campaign: Campaign, rows: Rows) -> list[Suspicion]:
    """Gives that the samples were not taken evenly, where this shows: every record counts as even."""
    even = [record for record in campaign.records if not record.resampled]
    worst = max(even, key=lambda record: record.time_jitter, default=campaign.records[0])
    error = float(np.sqrt(np.mean(rows.omega**2))) * worst.time_jitter
    if error <= _JITTERED:
        return []
    figure = (
        f"the times scatter by {1e3 * worst.time_jitter:.2g} ms rms about an even grid, which is "
        f"{100.0 * error:.2g} % of the response"
    )
    cause = Cause("sampling jitter", "the samples were not taken evenly", "set [sampling] resample = true")
    return [Suspicion("sample times", worst.name, figure, "even times", (cause,), False)]


def refuse_contradictions(campaign: Campaign) -> None:
    """Refuses records that cannot be what is declared: no physics is to be sought in them.

    Args:
        campaign: As declared.

    Raises:
        ValueError: If the records contradict the declaration: what speaks, the likely mistake, what to
            change.
    """
    for one in find_suspicions(campaign):
        if one.contradicts:
            raise ValueError(
                f"{campaign.file}: the records contradict their declaration. {one} To fit them all the same: "
                "--anyway, in Python anyway=True."
            )
