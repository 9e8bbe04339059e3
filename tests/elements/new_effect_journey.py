"""What must see a new effect, asked in a process whose package has one more: prints one line of JSON.

python new_effect_journey.py CATALOGUE_NAME FOLDER
"""

import json
import sys
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
from scipy.integrate import quad

jax.config.update("jax_enable_x64", True)
sys.path.insert(0, str(Path(__file__).parents[1] / "identification"))

from solved_by_scipy import MASS, solved  # noqa: E402

import isojax as ij  # noqa: E402
from isojax.identification import scales  # noqa: E402

ij.compile_quickly()
NAME, FOLDER = sys.argv[1], Path(sys.argv[2])
KIND, BASE = ij.elements.CATALOGUE[NAME], (ij.LinearStiffness(1.08e6), ij.LinearDamping(1e4))


def truth():
    """The effect at a strength that leaves the sum of both dampers positive at rest."""
    magnitudes = scales(solved(BASE, levels=(80.0,)))
    return eqx.tree_at(
        lambda element: getattr(element, KIND.strength),
        KIND.guess(magnitudes),
        jax.numpy.asarray(0.03 * KIND.typical_strength(magnitudes)),
    )


def work(element, amplitude: float, angular: float) -> float:
    """Energy that a static law takes from one cycle of a sine, by SciPy's quadrature."""

    def power(phase: float) -> float:
        x, v = amplitude * np.sin(phase), amplitude * angular * np.cos(phase)
        return float(element.force(jax.numpy.asarray(x), jax.numpy.asarray(v), ())) * v / angular

    return quad(power, 0.0, 2.0 * np.pi)[0]


def main() -> None:
    """Walk from records to the report, and print what was seen."""
    element = truth()
    loop = ij.close_loop(solved((*BASE, element)), max_iterations=1)
    loop.report(FOLDER)
    before = ij.fit(
        ij.Isolator(MASS, (ij.LinearStiffness(1.0e6), ij.LinearDamping(1e4))),
        solved((*BASE, element)),
        fixed=("linear_damping.coefficient",),
    )
    alone = ij.diagnose(before)
    model = ij.Isolator(MASS, (*BASE, element))
    orbit = ij.find_periodic_orbit(model, ij.Harmonic(100.0, 4.3))
    size, speed = 3.0 * float(element.threshold), 30.0
    seen = {
        "findings": [[one.effect, *one.indistinguishable] for one in loop.findings],
        "verdict": loop.verdict,
        "advice": loop.findings[0].separating_experiment,
        "alone": [alone.finding.effect, *alone.finding.indistinguishable] if alone.finding else [],
        "truth": [float(number) for number in (element.coefficient, element.threshold)],
        "alone_refit": [float(alone.refit.model[f"{NAME}.{field}"]) for field in ("coefficient", "threshold")]
        if alone.refit is not None and alone.refit.model.element(NAME)
        else [],
        "multipliers": np.abs(np.asarray(orbit.floquet.multipliers)).tolist(),
        "work": work(element, size, speed),
        "work_in_closed_form": np.pi
        * float(element.coefficient)
        * speed
        * size**2
        * (size**2 / (4.0 * float(element.threshold) ** 2) - 1.0),
    }
    print(json.dumps(seen))


main()
