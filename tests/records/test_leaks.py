"""A held-out record that is also fitted is found by its noise; a repeat under the same drive is not."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.signal

from isojax import read_campaign
from isojax.records import Campaign

RATE, SIZE, NOISE = 200.0, 2000, 4e-3
DECLARED = {
    "campaign": {"mass": 2.0},
    "input": {"quantity": "force", "column": "force", "unit": "N"},
    "output": {"quantity": "acceleration", "column": "acc", "unit": "m/s^2"},
    "sampling": {"rate": RATE},
}
Pair = tuple[np.ndarray, np.ndarray]


def response(force: np.ndarray) -> np.ndarray:
    """Acceleration of 2 kg on a spring of 8 Hz, damping ratio 4 %, by SciPy."""
    k, c = 2.0 * (16.0 * np.pi) ** 2, 0.16 * 16.0 * np.pi
    system = ([[0.0, 1.0], [-0.5 * k, -0.5 * c]], [[0.0], [0.5]], [[-0.5 * k, -0.5 * c]], [[0.5]])
    return scipy.signal.lsim(system, force, np.arange(force.size) / RATE)[1]


def drive(kind: str) -> np.ndarray:
    draw, time = np.random.default_rng(11), np.arange(SIZE) / RATE
    if kind == "random":
        return np.convolve(draw.standard_normal(SIZE), np.ones(4) / 4, "same")
    if kind == "sweep":
        return scipy.signal.chirp(time, 3.0, time[-1], 18.0)
    return np.tile(sum(np.sin(np.pi * k * time[:400] + k**2) for k in range(4, 40)), SIZE // 400)


DRIVES = ("random", "sweep", "multisine")


@pytest.fixture(scope="module", params=DRIVES)
def measured(request: pytest.FixtureRequest) -> Callable[[int], Pair]:
    """Gives drive and response of one measurement; another seed is a repeat with noise of its own."""
    force = drive(request.param)
    clean = response(force)

    def repeat(seed: int, noise: float = NOISE) -> Pair:
        scatter = noise * np.std(clean) * np.random.default_rng(seed).standard_normal(SIZE)
        return force, clean + scatter

    return repeat


def read(fitted: Pair, held: Pair, *forms: str) -> Campaign:
    """Reads both as records of one campaign, written with as many digits as the forms say."""
    data, records = {}, []
    pairs = zip(("fit", "holdout"), (fitted, held), (*forms, "%.9g", "%.9g")[:2], strict=True)
    for role, channels, form in pairs:
        written = [np.array([float(form % one) for one in channel]) for channel in channels]
        data[f"{role} run"] = dict(zip(("force", "acc"), written, strict=True))
        records.append({"file": f"{role} run", "role": role})
    return read_campaign({**DECLARED, "record": records}, data=data)


def of(pair: Pair, start: int, stop: int) -> Pair:
    return pair[0][start:stop], pair[1][start:stop]


@pytest.mark.parametrize("span", [(100, SIZE), (9, SIZE - 777), (750, 1250)])
def test_a_shifted_measurement_is_no_held_out_record(measured, span: tuple[int, int]) -> None:
    one = measured(1)
    with pytest.raises(ValueError, match=r"number 2, held out, is the measurement of number 1") as refused:
        read(one, of(one, *span))
    assert f"samples 0:{span[1] - span[0]} of" in str(refused.value)
    assert f"and {span[0]}:{span[1]} of" in str(refused.value)


@pytest.mark.parametrize("form", ["%.18g", "%.5g", "%.3g", "%.4f"])
def test_other_digits_make_no_other_measurement(measured, form: str) -> None:
    one = measured(1)
    with pytest.raises(ValueError, match=r"held-out samples must not be used to fit"):
        read(one, one, "%.9g", form)


def test_another_calibration_makes_no_other_measurement(measured) -> None:
    force, output = of(measured(1), 100, SIZE)
    with pytest.raises(ValueError, match=r"held-out samples must not be used to fit"):
        read(measured(1), (force, 1.02 * output + 0.3), "%.6g", "%.5g")


@pytest.mark.parametrize("noise", [NOISE, 1e-5])
@pytest.mark.parametrize("start", [0, 100])
def test_a_repeat_under_the_same_drive_may_be_held_out(measured, noise: float, start: int) -> None:
    held = of(measured(2, noise), start, SIZE)
    assert len(read(measured(1, noise), held).records) == 2


def test_repeats_in_few_digits_may_be_held_out(measured) -> None:
    """Of a reading in steps as large as its noise most samples of a repeat are equal, but not all."""
    assert len(read(measured(1), measured(2), "%.2f", "%.2f").records) == 2


def test_halves_of_one_measurement_may_be_fitted_and_held_out(measured) -> None:
    one = measured(1)
    halves = of(one, 0, SIZE // 2), of(one, SIZE // 2, SIZE)
    assert len(read(*halves).records) == 2
