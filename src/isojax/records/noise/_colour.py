"""The colour of the noise: an autoregressive law of what settled records leave without their harmonics."""

from typing import NamedTuple

import numpy as np
import scipy
from jaxtyping import Float

from ..._show import shown
from ..spectrum import Rest

MOST_ORDERS = 64
"""Highest order of the law. Noise of density 1/f needs all of them, a single time constant needs one."""

_LAGS_A_WINDOW = 0.25
"""Share of the shortest window that the lags may reach."""

_FALSE_COLOUR = 1e-3
"""Chance that white noise is taken for coloured."""

_AGREED = 1e-4
"""Change of the density, over itself, at which expectation and maximisation agree ..."""

_MOST_ROUNDS = 50
"""... and rounds after which they have to: each leaves at most a half of the error."""

_FREQUENCIES = 4096
"""Lines of the density up to half the rate, at least: finer than what the orders can distinguish."""


class Piece(NamedTuple):
    """Noise of one window.

    Attributes:
        rest: what the window leaves, and the share of the noise that the removed signals took of each line.
        kept: share of the noise of all frequencies that is left; 1 - 1/n of n periods less their mean.
    """

    rest: Rest
    kept: float = 1.0

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the mean square."""
        return self.kept * self.rest.signal.size - self.rest.taken.size

    def scaled(self, scale: float) -> "Piece":
        """Gives the same noise, so many times as large."""
        return self._replace(rest=self.rest._replace(signal=scale * self.rest.signal))


@shown
class Colour(NamedTuple):
    """An autoregressive law `n_t + a_1 n_(t-1) + ... + a_p n_(t-p) = e_t` of noise, with white e.

    Its density weighs the samples, but no band counts more than under white noise of the same rms. Where the
    noise is quieter than that, what a model leaves out is soon louder: the edge of a filter that nobody
    declared, for one.

    Attributes:
        law: a_1 to a_p.
        innovation: rms of e.
        sigma: rms of n.
        whitening: b_1 to b_q of the filter that weighs the samples: it makes noise white whose density is
            the larger of the two.
        level: rms of what such noise leaves behind the filter.
        share: chi-square that n leaves of a sample behind the filter, in units of `level`; 1 at most.
    """

    law: tuple[float, ...]
    innovation: float
    sigma: float
    whitening: tuple[float, ...]
    level: float
    share: float


def noise_colour(pieces: list[Piece], rate: float) -> Colour | None:
    """Gives the autoregressive law of noise, or None where it is not significantly coloured.

    The autocorrelations are those of the pooled windows. What the harmonics took with them is put back with
    the density that the law itself has there, and the law is estimated again until both agree (expectation
    and maximisation); else every harmonic would leave a notch in the spectrum. The law counts where that of
    least BIC, which takes no order by chance, has a likelihood ratio against white noise that is significant
    at 0.001. Its order is then that of least AICc, because 1/f noise has no finite one.

    Args:
        pieces: windows that hold noise alone.
        rate: samples per second [Hz].

    Returns:
        The law, with the filter that weighs; both have minimum phase.

    Source: Dempster, Laird & Rubin 1977 (EM); Durbin 1960 (recursion over the order); Schwarz 1978 (BIC);
        Shibata 1980, Ann. Stat. 8:147 (AIC predicts best where the order is not finite).
    """
    freedom = sum(piece.freedom for piece in pieces)
    shortest = min((piece.rest.signal.size for piece in pieces), default=0)
    most = min(MOST_ORDERS, int(_LAGS_A_WINDOW * shortest))
    if most < 1 or freedom <= most or not any(np.any(piece.rest.signal) for piece in pieces):
        return None
    lags = np.arange(most + 1)
    seen = np.sum([_products(piece.rest.signal, most) / piece.kept for piece in pieces], axis=0)
    size = np.sum([piece.rest.signal.size - lags for piece in pieces], axis=0)
    taken: dict[int, Float[np.ndarray, " line"]] = {}
    for piece in pieces:
        length = piece.rest.signal.size
        taken[length] = taken.get(length, 0.0) + piece.rest.removed
    longest = max(piece.rest.signal.size for piece in pieces)
    steps = max(_FREQUENCIES, longest)
    density, laws, errors = np.full(steps + 1, seen[0] / freedom), [np.zeros(0)], np.zeros(1)
    for _ in range(_MOST_ROUNDS):
        correlation = np.fft.irfft(density)[:longest]
        back = np.sum([_taken_products(*each, correlation, most) for each in taken.items()], axis=0)
        laws, errors = _levinson((seen + back) / size)
        known, density = density, _density(laws[-1], errors[-1], steps)
        if np.all(np.abs(density - known) <= _AGREED * known):
            break
    misfit, orders = freedom * np.log(errors), np.arange(errors.size)
    sure = int(np.argmin(misfit + orders * np.log(freedom)))
    if sure == 0 or scipy.stats.chi2.sf(misfit[0] - misfit[sure], sure) > _FALSE_COLOUR:
        return None
    order = _best_order(errors, freedom)
    # Each coefficient of the law takes a degree of freedom.
    innovation = errors[order] * freedom / (freedom - order)
    return _weighed(laws[order], float(innovation), float(errors[0]), freedom)


def _best_order(errors: Float[np.ndarray, " order"], freedom: float) -> int:
    """Gives the order of least AICc."""
    orders = np.arange(errors.size)
    penalty = 2.0 * orders * freedom / np.maximum(freedom - orders - 2.0, 1.0)
    return int(np.argmin(freedom * np.log(errors) + penalty))


def _density(law: Float[np.ndarray, " order"], innovation: float, steps: int) -> Float[np.ndarray, " line"]:
    """Gives the density of a law at so many steps up to half the rate, in variance per sample."""
    return innovation / np.abs(np.fft.rfft([1.0, *law], 2 * steps)) ** 2


def _taken_products(
    length: int, removed: Float[np.ndarray, " line"], correlation: Float[np.ndarray, " time"], most: int
) -> Float[np.ndarray, " lag"]:
    """Gives the products that harmonics took, in windows of one length, from noise of known autocorrelation.

    A window does not distinguish lines closer than its own, so that it counts with their mean, which also
    keeps what is put back from growing from one round to the next.
    """
    if not np.any(removed):
        return np.zeros(most + 1)
    part = correlation[:length] * (1.0 - np.arange(length) / length)
    line = 2.0 * np.fft.rfft(part).real - part[0]
    return np.fft.irfft(line * removed, length)[: most + 1] * length


def _weighed(law: Float[np.ndarray, " order"], innovation: float, square: float, freedom: float) -> Colour:
    """Gives a law with the filter that weighs by its density, raised to that of white noise of its rms."""
    density = _density(law, innovation, _FREQUENCIES)
    raised = np.fft.irfft(np.maximum(density, square))
    laws, errors = _levinson(raised[: MOST_ORDERS + 1])
    order = _best_order(errors, freedom)
    share = np.fft.irfft(density / _density(laws[order], float(errors[order]), _FREQUENCIES))[0]
    return Colour(
        law=tuple(law.tolist()),
        innovation=float(np.sqrt(innovation)),
        sigma=float(np.sqrt(square)),
        whitening=tuple(laws[order].tolist()),
        level=float(np.sqrt(errors[order])),
        share=float(share),
    )


def whitened_square(piece: Piece, colour: Colour) -> tuple[float, float]:
    """Gives the mean square of a window's innovations and its degrees of freedom."""
    order = len(colour.law)
    white = np.asarray(scipy.signal.lfilter([1.0, *colour.law], [1.0], piece.rest.signal))[order:]
    freedom = piece.freedom - order
    return float(white @ white) / max(freedom, 1.0), max(freedom, 1.0)


def _products(signal: Float[np.ndarray, " time"], most: int) -> Float[np.ndarray, " lag"]:
    """Gives the sums of products of a signal with itself, at lags from 0 on."""
    length = signal.size + most + 1
    power = np.abs(np.fft.rfft(signal, length)) ** 2
    return np.fft.irfft(power, length)[: most + 1]


def _levinson(
    correlation: Float[np.ndarray, " lag"],
) -> tuple[list[Float[np.ndarray, " _"]], Float[np.ndarray, " order"]]:
    """Gives the laws of all orders and their mean squared errors; it ends where no law has minimum phase."""
    law, laws, errors = np.zeros(0), [np.zeros(0)], [float(correlation[0])]
    for order in range(1, correlation.size):
        reflection = -(correlation[order] + law @ correlation[order - 1 : 0 : -1]) / errors[-1]
        if not abs(reflection) < 1.0:
            break
        law = np.append(law + reflection * law[::-1], reflection)
        laws.append(law)
        errors.append(errors[-1] * float(1.0 - reflection**2))
    return laws, np.array(errors)
