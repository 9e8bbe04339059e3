"""From the fine grid to the record: zero-phase anti-alias filter and decimation, alike for both channels."""

import math

import numpy as np
from jaxtyping import Float
from scipy import signal

_FINEST = 16_000.0
_STOP_DB = 90.0
_PASS, _STOP = 0.40, 0.50


def oversampling(rate: float) -> int:
    """Fine samples per recorded one: at least 16, and the fine grid at 16 kHz or finer."""
    return max(16, math.ceil(_FINEST / rate))


def anti_alias_taps(rate: float) -> Float[np.ndarray, " tap"]:
    """Symmetric low-pass filter at the fine rate: flat to 0.40 of `rate`, 90 dB down from 0.50 of `rate` on.

    What the recorded samples hold of the signals' 1/f tails (the jump of a sliding friction, say) is
    therefore free of aliases from below the fine grid's own Nyquist frequency, and a linear relation between
    the channels is kept as it is.
    """
    factor = oversampling(rate)
    fine = rate * factor
    count, beta = signal.kaiserord(_STOP_DB, (_STOP - _PASS) * rate / (fine / 2))
    reach = factor * math.ceil(count / 2 / factor)
    cutoff = (_PASS + _STOP) * rate / fine
    taps = np.sinc(cutoff * np.arange(-reach, reach + 1)) * np.kaiser(2 * reach + 1, beta)
    return taps / taps.sum()


def decimated(
    fine: Float[np.ndarray, " fine"], taps: Float[np.ndarray, " tap"], factor: int
) -> Float[np.ndarray, " time"]:
    """Every `factor`-th sample of the filtered signal, as far as the taps are fully covered.

    Args:
        fine: signal on the fine grid.
        taps: of the filter; their number less one is a multiple of `factor`.
        factor: fine samples per recorded one.
    """
    span = (taps.size - 1) // factor
    return signal.upfirdn(taps, fine, down=factor)[span : (fine.size - 1) // factor + 1]
