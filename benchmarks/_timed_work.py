"""Time a map and a fit of this checkout's isojax: `python _timed_work.py CAMPAIGN`; prints seconds as JSON.

`before_after.py` runs it with the sources of two commits in turn, so that only public names are used here.
"""

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import jax

jax.config.update("jax_enable_x64", True)

import numpy as np  # noqa: E402  (float64 first)

import isojax as ij  # noqa: E402

REPEATS = 5


def seconds(work: Callable[[], Any]) -> float:
    """Give the median time of some repeats, after a first call that compiles."""
    work()
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return float(np.median(times))


def main() -> None:
    """Time both."""
    model = ij.paper.y_direction()
    amplitudes, frequencies = np.linspace(1.0, 120.0, 1000), np.linspace(4.0, 8.0, 500)
    campaign = ij.read_campaign(sys.argv[1])
    start = ij.classical_guess(campaign).model
    taken = {
        "map, 1000 x 500 cells": seconds(
            lambda: np.asarray(ij.stability_map(model, amplitudes, frequencies).spectral_radius)
        ),
        "fit, 6 coefficients": seconds(lambda: ij.fit(start, campaign)),
    }
    print(json.dumps(taken))


if __name__ == "__main__":
    main()
