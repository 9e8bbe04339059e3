"""Event-exact integration: order-8 steps that end at every kink and jump of the laws.

Dormand-Prince 8(5,3) with its order-7 interpolant (Hairer, Norsett & Wanner, Solving Ordinary Differential
Equations I, II.5-6; the table is SciPy's). Between events the right-hand side is analytic, so that the order
holds. An event ends the step: it is located on the interpolant and the step is then taken anew up to there.
"""

from collections.abc import Callable, Sequence
from operator import mul
from typing import Any, NamedTuple, no_type_check

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

from ._force_pieces import ForcePiece
from ._law import velocity
from ._motion_equation import EquationOfMotion
from ._path import Path, powers

_STAGES = 12
# The table as numbers: with two or three states a step takes a fifth less time than with arrays.
_A = [DOP853.A[s, :s].tolist() for s in range(_STAGES)]
_B = DOP853.B.tolist()
_C = DOP853.C[:_STAGES].tolist()
_E5, _E3 = DOP853.E5.tolist(), DOP853.E3.tolist()
_A_EXTRA = [row[: _STAGES + 1 + s].tolist() for s, row in enumerate(DOP853.A_EXTRA)]
_C_EXTRA = DOP853.C_EXTRA.tolist()
_D = DOP853.D.tolist()
_LOOKS = np.arange(1, 9) / 8
_LOOK_POWERS = np.stack(powers(_LOOKS))
_EARLY = [0.0, *(_LOOKS[0] * 2.0 ** -np.arange(10, 0, -1)).tolist()]
_SMALLEST = 1e-9
_SHORTEST = 1e-15
_MOST_TRIES = 50
_MOST_CORRECTIONS = 3
_NUDGE = 1e-3


class _Event(NamedTuple):
    """One event within a step."""

    margin: Callable[..., Any]
    """Function of times and states, numbers or arrays, that is zero there."""
    value: Callable[[float], float]
    """The same along the step's interpolant, as a function of the share of the step."""
    happen: Callable[..., None]
    """What happens there, given time, state and whether it does so at the step's very start."""
    scale: float
    """Largest size of the margin over the step."""


class PlantIntegrator:
    """Integrates one plant under a chain of pieces and keeps its path.

    Args:
        balance: the plant's force balance.
        tolerance: local error of a step over the largest value that the state has had so far.
    """

    def __init__(self, balance: EquationOfMotion, tolerance: float = 3e-10) -> None:
        self._balance = balance
        self._tolerance = tolerance
        self._slopes = [[0.0] * (_STAGES + 4) for _ in range(balance.order)]  # of each state, at each stage
        self._largest = [_SMALLEST] * balance.order
        self._sides = [1.0] * balance.sides
        self._stuck = False
        self._first_slope_holds = False
        self._path = Path()
        self._turning = [own for switch, _, own in balance.watches if switch is velocity]

    @no_type_check
    def run(self, pieces: Sequence[ForcePiece], start: Sequence[float]) -> Path:
        """Path from the state `start` at the first piece's start to the last one's stop.

        Args:
            pieces: the acting force, without gaps.
            start: the state at the first piece's start.

        Raises:
            RuntimeError: if the motion runs away.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            return self._run(pieces, start)

    @no_type_check
    def _run(self, pieces, start):
        """Path from the first piece's start to the last one's stop."""
        y = [float(one) for one in start]
        for switch, states, own in self._balance.watches:
            self._put_side(own, 1.0 if switch(y[0], y[1], y[states]) >= 0 else -1.0)
        size = 1e-3
        for piece in pieces:
            t, longest = piece.start, piece.longest_step
            self._come_to_rest(t, y, piece)
            self._first_slope_holds = False
            while t < piece.stop:
                t, y, size = self._step(t, y, min(size, longest), piece)
        return self._path

    @no_type_check
    def _put_side(self, own, side):
        for k in own:
            self._sides[k] = side

    @no_type_check
    def _come_to_rest(self, t, y, piece):
        """Where the velocity is zero, choose between sticking, sliding up and sliding down."""
        if y[1] != 0.0:
            return
        lower, upper = self._balance.holding
        net = self._balance.net_at_rest(t, y, piece.force(t), self._sides)
        self._stuck = self._balance.sticks and lower <= net <= upper
        for own in self._turning:
            self._put_side(own, 1.0 if net > upper else -1.0)

    @no_type_check
    def _step(self, t, y, size, piece):
        """One accepted step, cut at the first event in it: the new time, state and proposed size."""
        left = piece.stop - t
        for _ in range(_MOST_TRIES):
            last = size >= left
            trial = left if last else size
            if trial < _SHORTEST * max(1.0, abs(t)) and not last:
                break
            end, error = self._stages(t, y, trial, piece)
            if not error <= 1.0:
                size = trial * max(0.2, 0.9 * error**-0.125)
                continue
            size = trial * min(5.0, 0.9 * max(error, 1e-9) ** -0.125)
            coefficients = self._interpolant(t, y, end, trial, piece)
            share, event = self._first_event(t, y, trial, coefficients, piece)
            if share == 0.0:
                event.happen(t, y, True)
                self._first_slope_holds = False
                continue
            self._path.add(t, trial, y, coefficients, self._sides, self._stuck)
            if share < 1.0:
                last = False
                trial, end = self._cut_step(t, y, trial, share, event, piece)
                event.happen(t + trial, end, False)
            self._first_slope_holds = share == 1.0
            if self._first_slope_holds:
                for own in self._slopes:
                    own[0] = own[_STAGES]
            self._largest = [max(most, abs(one)) for most, one in zip(self._largest, end, strict=True)]
            return (piece.stop if last else t + trial), end, size
        raise RuntimeError(f"The motion of the simulated plant must stay finite, but at t = {t} s it is {y}.")

    @no_type_check
    def _put_slopes(self, stage, t, y, piece):
        """Put the rates of the state at an instant among the slopes of the step."""
        rates = self._balance.rates_stuck if self._stuck else self._balance.rates
        for own, rate in zip(self._slopes, rates(t, y, piece.force(t), self._sides), strict=True):
            own[stage] = rate

    @no_type_check
    def _ahead(self, y, size, weights):
        """State after a step of a size along the weighted slopes of its first stages."""
        return [one + size * sum(map(mul, weights, own)) for one, own in zip(y, self._slopes, strict=True)]

    @no_type_check
    def _stages(self, t, y, size, piece):
        """State after a step and its local error over the tolerance."""
        if not self._first_slope_holds:
            self._put_slopes(0, t, y, piece)
            self._first_slope_holds = True
        for stage in range(1, _STAGES):
            self._put_slopes(stage, t + _C[stage] * size, self._ahead(y, size, _A[stage]), piece)
        end = self._ahead(y, size, _B)
        self._put_slopes(_STAGES, t + size, end, piece)
        fifth = third = 0.0
        for one, most, own in zip(end, self._largest, self._slopes, strict=True):
            scale = self._tolerance * max(most, abs(one))
            fifth += (sum(map(mul, _E5, own)) / scale) ** 2
            third += (sum(map(mul, _E3, own)) / scale) ** 2
        if fifth == 0.0:
            return end, 0.0
        return end, size * fifth / ((fifth + 0.01 * third) * len(y)) ** 0.5

    @no_type_check
    def _interpolant(self, t, y, end, size, piece):
        """Coefficients of the interpolant of the step just taken, seven a state."""
        for extra, weights in enumerate(_A_EXTRA):
            ahead = self._ahead(y, size, weights)
            self._put_slopes(_STAGES + 1 + extra, t + _C_EXTRA[extra] * size, ahead, piece)
        coefficients = []
        for first, last, own in zip(y, end, self._slopes, strict=True):
            change = last - first
            coefficients.append(
                [
                    change,
                    size * own[0] - change,
                    2 * change - size * (own[_STAGES] + own[0]),
                    *(size * sum(map(mul, weights, own)) for weights in _D),
                ]
            )
        return coefficients

    @no_type_check
    def _first_event(self, t, y, size, coefficients, piece):
        """Share of the step at which the first event falls, 1 for none, and the event."""
        earliest, event = 1.0, None
        looks = np.array(y)[:, None] + np.array(coefficients) @ _LOOK_POWERS
        for margin, happen in self._margins(piece):
            values = margin(t + _LOOKS * size, looks)

            def value(share, margin=margin):
                basis = powers(share)
                state = [one + sum(map(mul, basis, own)) for one, own in zip(y, coefficients, strict=True)]
                return margin(t + share * size, state)

            share = _first_zero(values, value)
            if share < earliest:
                earliest, event = share, _Event(margin, value, happen, float(np.abs(values).max()))
        return earliest, event

    @no_type_check
    def _cut_step(self, t, y, size, share, event, piece):
        """Size and end of the step that ends at an event, whose place the interpolant gives too coarsely."""
        for _ in range(_MOST_CORRECTIONS):
            end, _ = self._stages(t, y, share * size, piece)
            miss = event.margin(t + share * size, end)
            if abs(miss) <= self._tolerance * event.scale:
                break
            slope = (event.value(share) - event.value(share * (1 - _NUDGE))) / (share * _NUDGE)
            if abs(miss) >= _NUDGE * share * abs(slope):
                break
            share -= miss / slope
        return share * size, end

    @no_type_check
    def _margins(self, piece):
        """Functions of times and states that stay positive until an event, each with what then happens.

        They take arrays of instants or single ones.
        """
        balance, sides = self._balance, self._sides
        for switch, inner, own in balance.watches:
            if switch is not velocity:

                def margin(times, states, switch=switch, inner=inner, side=sides[own[0]]):
                    return side * switch(states[0], states[1], states[inner])

                def cross(t, y, at_once, own=own):
                    self._put_side(own, -sides[own[0]])

                yield margin, cross
            elif not self._stuck:
                yield lambda times, states, side=sides[own[0]]: side * states[1], self._turn(piece)
        if self._stuck:
            lower, upper = balance.holding
            yield lambda times, states: upper - self._net(times, states, piece), self._break_away(1.0)
            yield lambda times, states: self._net(times, states, piece) - lower, self._break_away(-1.0)

    @no_type_check
    def _net(self, times, states, piece):
        push = piece.forces(times) if isinstance(times, np.ndarray) else piece.force(times)
        return self._balance.net_at_rest(times, states, push, self._sides)

    @no_type_check
    def _turn(self, piece):
        """What happens where the velocity vanishes: the motion turns or sticks."""

        def turn(t, y, at_once):
            if self._balance.sticks and at_once:
                self._stuck = True
                y[1] = 0.0
            elif self._balance.sticks:
                y[1] = 0.0
                self._come_to_rest(t, y, piece)
            else:
                for own in self._turning:
                    self._put_side(own, -self._sides[own[0]])

        return turn

    @no_type_check
    def _break_away(self, side):
        """What happens where friction can hold no longer."""

        def break_away(t, y, at_once):
            self._stuck = False
            for own in self._turning:
                self._put_side(own, side)

        return break_away


@no_type_check
def _first_zero(values, value):
    """Share in (0, 1) at which a margin first falls below zero, 1.0 if nowhere, 0.0 if it starts to at once.

    Args:
        values: the margin at the looks.
        value: the margin at any share.
    """
    below = values < 0
    if below[0]:
        fine = [share for share in _EARLY if value(share) > 0]
        if not fine:
            return 0.0
        after = min(share for share in (*_EARLY, _LOOKS[0]) if share > fine[-1])
        return brentq(value, fine[-1], after, xtol=1e-15)
    first = int(below.argmax()) if below.any() else values.size
    for k in range(1, min(first, values.size - 1)):
        if values[k] < values[k - 1] and values[k] <= values[k + 1]:
            slope, bend = (values[k + 1] - values[k - 1]) / 2, values[k + 1] - 2 * values[k] + values[k - 1]
            bottom = _LOOKS[k] - slope / bend * _LOOKS[0]
            if values[k] - slope**2 / (2 * bend) < 0 and value(bottom) < 0:
                return brentq(value, _LOOKS[k - 1], bottom, xtol=1e-15)
    if first < values.size:
        return brentq(value, _LOOKS[first - 1], _LOOKS[first], xtol=1e-15)
    return 1.0
