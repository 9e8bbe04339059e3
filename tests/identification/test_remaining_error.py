from pathlib import Path

import numpy as np

from isojax.identification.diagnosis._remaining_error import remaining_words
from isojax.identification.fitting import Run
from isojax.records import Record

RATE = 100.0


def run_of(output, error, role="fit"):
    time = np.arange(output.size) / RATE
    record = Record("r", Path("r.npz"), time, RATE, 0.0 * time, output, 0.0 * time, output, role=role)
    return Run(record, output - error, np.ones(output.size))


def tone(frequency, samples=6000):
    return np.sin(2.0 * np.pi * frequency * np.arange(samples) / RATE)


def test_the_band_and_the_size_of_the_motion_are_told():
    loud = np.where(np.arange(6000) < 3000, 1.0, 0.1)
    words = remaining_words([run_of(loud * tone(2.0), 0.2 * loud**2 * tone(5.0))])
    assert "lies from 5 to 5" in words
    assert "2.00 % of small motion and 20.0 % of large" in words


def test_an_error_in_proportion_is_called_so():
    words = remaining_words([run_of(tone(2.0), 0.1 * tone(5.0))])
    assert "as large a share of small motion as of large" in words


def test_half_of_the_square_of_two_tones_lies_on_the_larger():
    words = remaining_words([run_of(tone(2.0), 0.1 * tone(5.0) + 0.2 * tone(10.0))])
    assert "lies from 10 to 10" in words


def test_no_error_has_no_words():
    assert remaining_words([run_of(tone(2.0), 0.0 * tone(2.0))]) == ""
    assert remaining_words([run_of(tone(2.0), tone(5.0), role="holdout")]) == ""


def test_a_run_that_diverged_has_no_words():
    error = tone(5.0)
    error[3000:] = np.nan
    assert remaining_words([run_of(tone(2.0), error), run_of(tone(2.0), tone(5.0))]) == ""
