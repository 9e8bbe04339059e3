"""Every number that decides a verdict stands in Rules, once, with its meaning."""

import ast
import dataclasses
import itertools
from collections import defaultdict
from pathlib import Path

import pytest

import isojax
from isojax import rig
from isojax.elements import LinearDamping, LinearStiffness
from isojax.identification import Rules, close_loop, diagnose, fit
from isojax.identification._rules import Rules as DefinedRules
from isojax.models import Integrator, Isolator

SOURCE = Path(isojax.__file__).parent
ROOMS = SOURCE / "identification"
ACCURACY = {
    # Rounding, and what is too large to be a motion.
    "_alternative_laws": {"SAME_TRACE"},
    "_covariance": {"PARTNER", "SMALLEST_EIGENVALUE"},
    "_elimination": {"SMALLEST_EIGENVALUE"},
    "_simulator": {"HUGE"},
    # Integration: steps, and when they are fine enough; loops of a law that must be closed.
    "_integration_steps": {"FINEST", "SEGMENTS_TRIED", "SMALL_ERROR"},
    "_passivity": {"STEADY", "WORK_OF_STEPS"},
    # Where a search stands still, or goes astray.
    "_descent": {"IDLE", "KEPT", "REFUSALS_A_STEP", "SHRINKS", "STALLED"},
    "_estimate": {"MUCH_LESS_SCATTER", "ROUGH", "SMALLEST_SCATTER"},
    "_initial_states": {"BAD_START", "HALVINGS", "MOST_WORSENING", "SETTLED", "SHORTEST", "SMALL_STEP"},
    # Draws and intervals.
    "_scatter_mixture": {"LEAST_TAIL"},
    "_valley": {"SAME_RISE", "WELL_KNOWN"},
    "_score": {"FEWEST_EXCEEDANCES", "NULL_DRAWS"},
    # How records are cut, repeats recognised and spectra read.
    "_batch": {"MOST_LANES"},
    "_build_problem": {"SAME_RATE"},
    "_dwell_remainder": {"FEWEST_SETTLED_CYCLES", "HARMONICS", "SAMPLES_A_NUMBER"},
    "_force_residual": {"HIGHEST_SHARE"},
    "_lack_of_fit": {"HIGHEST", "HIGHEST_ORDER", "LINES_A_BAND", "LINES_BESIDE"},
    "_remainder": {"FEWEST_CELL_SAMPLES"},
    "_residual": {"MOST_LAGS"},
    "_score_columns": {"ENTRIES", "LEAST_COLUMNS"},
    # What a filter follows, how much of it, and how large its covariance may grow.
    "_fit": {"MOST_EVALUATIONS"},
    "_fit_of_errors": {"LEAST_KEPT", "LOUDEST", "MUCH_LESS", "POWER", "SHORTEST_RECORD"},
    # When what a fit leaves is the noise by which it was weighted.
    "_effect_search": {"SMALLER"},
    "_by_innovations": {"NEXT"},
    "_segment_scatter": {"SAME_DRIVE_AND_RESPONSE", "SAME_FREQUENCY"},
    "_segments": {"DECAY_TIMES_A_WINDOW", "FEWEST_WINDOWS", "SHORTEST", "SHORTEST_WINDOW"},
    # What is drawn up and shown.
    "_fit_result": {"STRONG", "UNMOVED"},
    "_prediction_errors": {"FED"},
    "_remaining_error": {"APART"},
    "_free_laws": {"ORDER"},
    "_free_traces": {"SAME_LAW"},
}
"""Constants that a file compares with to compute accurately, not to decide what the records show."""

NEUTRAL = {0, 1, 2, -1, 0.5, 1e-300, 1e-60, 1e-9}
"""Numbers in a comparison that decide nothing: signs, counts of one or two, halves, rounding."""

BOUNDS = {"min", "max", "minimum", "maximum", "clip"}


def _constants(file):
    """Names and values of the numbers that a file defines for itself."""
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            try:
                value = ast.literal_eval(node.value)
            except ValueError:
                continue
            if isinstance(value, int | float | tuple):
                yield node.targets[0].id.lstrip("_"), value


def test_each_rule_has_a_positive_default_and_its_meaning_below_it():
    body = next(
        node
        for node in ast.parse((ROOMS / "_rules.py").read_text(encoding="utf-8")).body
        if isinstance(node, ast.ClassDef)
    ).body
    for place, node in enumerate(body):
        if isinstance(node, ast.AnnAssign):
            words = body[place + 1]
            assert isinstance(words, ast.Expr), ast.unparse(node)
            assert len(ast.literal_eval(words.value)) > 30
    values = dataclasses.asdict(Rules())
    assert all(min(value) > 0 if isinstance(value, tuple) else value > 0 for value in values.values())
    assert Rules is DefinedRules


def test_each_rule_is_read_somewhere():
    code = "".join(
        file.read_text(encoding="utf-8") for file in ROOMS.rglob("*.py") if file.name != "_rules.py"
    )
    unread = [name for name in dataclasses.asdict(Rules()) if f"ules.{name}" not in code]
    assert unread == []


def _compared(file):
    """List the numbers and constants with which a file compares: by size, or as a bound of min and max."""
    ordering = ast.Lt | ast.LtE | ast.Gt | ast.GtE
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Compare) and any(isinstance(one, ordering) for one in node.ops):
            sides = [node]
        elif isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in BOUNDS:
            sides = node.args
        else:
            continue
        for part in itertools.chain.from_iterable(map(ast.walk, sides)):
            if isinstance(part, ast.Constant) and isinstance(part.value, int | float):
                yield part.value
            elif isinstance(part, ast.Name) and part.id.isupper():
                yield part.id.lstrip("_")


def test_what_decides_a_verdict_is_compared_with_a_rule():
    rooms = ("diagnosis", "fitting", "jacobian", "remainder", "traces")
    files = [ROOMS / "_close_loop.py", *(file for room in rooms for file in (ROOMS / room).glob("*.py"))]
    found = {(file.stem, one) for file in files for one in _compared(file) if one not in NEUTRAL}
    assert found == {(file, name) for file, names in ACCURACY.items() for name in names}


def test_no_two_constants_of_one_name_have_different_values():
    values = defaultdict(set)
    for file in SOURCE.rglob("*.py"):
        if "rig" not in file.relative_to(SOURCE).parts:
            for name, value in _constants(file):
                if not isinstance(value, tuple):
                    values[name].add(value)
    assert {name for name, known in values.items() if len(known) > 1} == set()


@pytest.fixture(scope="module")
def rubbing(simulated):
    """A campaign of a plant with dry friction that the declared model lacks."""
    plant = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4), rig.CoulombFriction(4.0)))
    plan = rig.Multisine((40.0, 70.0, 110.0), 2.0, 14.0, period=2.0, periods=4, lines="full")
    bench = rig.Bench(rate=250.0, noise=5e-3, drift=0.0, force_noise=0.0, anti_alias=False, tolerance=1e-7)
    return simulated(plant, plan, 7, bench, stiffness=("linear",), damping=("linear",))


def test_other_rules_give_another_verdict(rubbing):
    start = Isolator(800.0, (LinearStiffness(1.05e6), LinearDamping(1.1e4)))
    found = fit(start, rubbing, integrator=Integrator())
    strict = diagnose(found, rules=Rules(smallest_gain=100.0))
    assert strict.finding is None
    assert strict.verdict == "unexplained"
    rough = dataclasses.replace(rubbing, output=dataclasses.replace(rubbing.output, accuracy=10.0))
    lax = fit(start, rough, integrator=Integrator())
    assert diagnose(lax, rules=Rules(smallest_gain=100.0, good=1e3)).verdict == "none"
    assert diagnose(found).finding.effect == "coulomb_friction"


def test_a_loop_hands_its_rules_on(rubbing):
    rules = Rules(smallest_visibility=2.0)
    loop = close_loop(rubbing, rules=rules)
    assert loop.last.ranking == ()
    assert "coulomb_friction" in loop.last.hidden
    assert loop.rules == rules
    assert loop.remainder is not None
    assert loop.remainder.pursuit.laws == ()


def test_the_loop_with_its_report_hands_on_what_is_excluded(rubbing):
    with pytest.raises(ValueError, match="`excluded` must hold catalogue names, but 'nothing_known'"):
        isojax.close_loop(rubbing, excluded=("nothing_known",))
