"""The scan over records and the single simulation are one integrator."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax import paper
from isojax.elements import MaxwellBranch
from isojax.excitations import Sampled, tabulate
from isojax.models import RK4, Instant, Integrator, scan_records, simulate

RATE, COUNT, SUBSTEPS = 1000.0, 1500, 4


def drives() -> np.ndarray:
    """Two records of different level and frequency, one column each."""
    t = np.arange(COUNT) / RATE
    return np.stack([150.0 * np.sin(2 * np.pi * 4.3 * t), 60.0 * np.sin(2 * np.pi * 5.7 * t + 0.4)], axis=1)


@pytest.mark.parametrize("hold", ["band_limited", "linear", "zero_order"])
def test_records_side_by_side_are_the_single_simulations(hold):
    model = paper.y_direction().with_elements(MaxwellBranch(2e4, 0.03))
    tables = [tabulate(column, RATE, hold, SUBSTEPS)[0] for column in drives().T]
    start = tuple(jnp.asarray([value, -value]) for value in (1e-3, 0.01, 2e-4))

    def observe(state, at):
        return state[0], model.reading(state, at, "acceleration")

    drive = jnp.asarray(np.stack(tables, axis=-1))
    end, (displacement, reading), ringing = jax.jit(
        lambda record: scan_records(model, RK4(), "acceleration", 1.0 / RATE, start, record, observe)
    )(Instant(drive, jnp.zeros_like(drive)))
    for lane in range(2):
        record = simulate(
            model,
            Sampled(drives()[:, lane], RATE, hold),
            duration=(COUNT - 1) / RATE,
            initial_state=tuple(value[lane] for value in start),
            integrator=Integrator(substeps=SUBSTEPS),
        )
        size = float(jnp.max(jnp.abs(record.displacement)))
        np.testing.assert_allclose(displacement[:, lane], record.displacement, atol=1e-12 * size)
        size = float(jnp.max(jnp.abs(record.reading)))
        np.testing.assert_allclose(reading[:, lane], record.reading, atol=1e-11 * size)
    assert all(value.shape == (2,) for value in end)
    assert ringing is None


def test_the_drive_rate_reaches_the_instruments():
    model = paper.y_direction()
    values, slopes = tabulate(drives()[:, 0], RATE, "band_limited", 1)
    _, seen, _ = scan_records(
        model,
        RK4(),
        "acceleration",
        1.0 / RATE,
        (jnp.zeros(1), jnp.zeros(1)),
        Instant(jnp.asarray(values)[..., None], jnp.asarray(slopes)[..., None]),
        lambda state, at: at.drive_rate,
    )
    t = np.arange(COUNT) / RATE
    expected = 150.0 * 2 * np.pi * 4.3 * np.cos(2 * np.pi * 4.3 * t)
    np.testing.assert_allclose(seen[200:-200, 0], expected[200:-200], rtol=0.0, atol=1e-5 * np.max(expected))
