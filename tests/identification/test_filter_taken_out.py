"""A filter that force and response share bends a cubic spring, unless the reader takes it out."""

import numpy as np
import pytest
import scipy.signal

from isojax import classical_guess, fit, read_campaign, rig

RATE, ORDER, CUTOFF = 250.0, 2, 20.0
NAME = "cubic_stiffness.coefficient"
CUBIC = 2.5e11
PLANT = rig.Plant((rig.LinearStiffness(1.08e6), rig.CubicStiffness(CUBIC), rig.LinearDamping(1e4)))
PLAN = rig.SteppedSine((60.0, 120.0), (4.4, 5.2, 6.0), 12)


def _filed(folder):
    """A campaign whose recorder ran both channels through a Butterworth filter, forwards."""
    bench = rig.Bench(rate=RATE, noise=2e-4, force_noise=0.0, drift=0.0)
    file = rig.write_campaign(folder, PLANT, PLAN, 3, "filtered", bench)
    sections = scipy.signal.butter(ORDER, CUTOFF, fs=RATE, output="sos")
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as arrays:
            columns = {
                name: scipy.signal.sosfilt(sections, arrays[name])
                if name in ("force", "acceleration")
                else arrays[name]
                for name in arrays
            }
        np.savez(path, **columns)
    text = file.read_text(encoding="utf-8")
    text = text.replace('["linear", "abs_quadratic", "cubic"]', '["linear", "cubic"]', 1)
    return file, text.replace('["linear", "abs_quadratic", "cubic"]', '["linear"]', 1)


def test_a_cubic_spring_is_right_where_the_filter_is_taken_out(tmp_path):
    file, text = _filed(tmp_path)
    off = {}
    for compensate in (False, True):
        flag = str(compensate).lower()
        low = f"[filter]\norder = {ORDER}\ncutoff_hz = {CUTOFF}\ncompensate = {flag}\n"
        file.write_text(f"{text}\n{low}", encoding="utf-8")
        campaign = read_campaign(file)
        found = fit(classical_guess(campaign).model, campaign)
        off[compensate] = float(found.model[NAME]) / CUBIC - 1.0, found.standard_errors[NAME] / CUBIC
    error, sigma = off[False]
    assert abs(error) > max(0.015, 5.0 * sigma)
    error, sigma = off[True]
    assert abs(error) < 3.0 * sigma < 0.01
    assert found.stats.chi2 / found.stats.dof < 1.1


def test_a_record_too_short_for_what_is_lost_at_its_ends_is_refused(tmp_path):
    file, text = _filed(tmp_path)
    text = text.replace('role = "fit"', 'role = "fit"\nstop = 200', 1)
    file.write_text(f"{text}\n[filter]\norder = 2\ncutoff_hz = 20.0\ncompensate = true\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"number 1 is too short: of its samples 100 at either end are lost"):
        read_campaign(file)
