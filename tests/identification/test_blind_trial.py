"""The blind trial: its draws and its arithmetic."""

import math
import sys
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate, stats

from isojax import rig
from isojax.elements import CATALOGUE, Scales

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from _trial_campaign import kind_of, sketch
from _trial_effects import COMMONEST, EFFECTS, Motion, element_of, generator, shuffled_effects
from _trial_judge import table, wilson
from _trial_outside import OUTSIDE
from blind_trial import read

MOTION = Motion(40.0, 1e-3, 1.0, 31.0, 1.08e6, 1.03e4)
SCALES = Scales(800.0, 150.0, 1e-3, 0.031, 1.0, 31.0, 0.004, 0.01, 1.0)


def test_the_interval_of_a_share_is_wilsons():
    for hits, count in ((0, 7), (3, 20), (20, 20), (57, 61)):
        known = stats.binomtest(hits, count).proportion_ci(method="wilson")
        assert wilson(hits, count) == pytest.approx((known.low, known.high), abs=1e-6)


def test_a_seed_draws_the_same_campaign_again_and_another_seed_another():
    assert sketch(5) == sketch(5)
    assert sketch(5).base != sketch(6).base
    kinds = [kind_of(seed) for seed in range(400)]
    assert {kind: kinds.count(kind) > 30 for kind in kinds} == dict.fromkeys(
        ("none", "one", "two", "outside"), True
    )


def test_every_campaign_has_records_of_equal_length_and_two_held_out():
    for seed in range(40):
        drawn = sketch(seed)
        trials = [trial for plan in drawn.plans for trial in plan.trials(drawn.bench.shaker, seed)]
        assert {round(trial.seconds * drawn.bench.rate) for trial in trials} == {8000}
        assert [trial.role for trial in trials].count("holdout") == 2
        assert len(trials) == 6
        assert all(0.0 <= drawn.bench.drift <= 0.002 for _ in trials)


def test_a_new_line_in_the_table_leaves_the_order_of_the_others(monkeypatch):
    before = {seed: shuffled_effects(seed) for seed in range(50)}
    monkeypatch.setitem(EFFECTS, "yet_another", EFFECTS["input_delay"])
    for seed, order in before.items():
        assert tuple(name for name in shuffled_effects(seed) if name != "yet_another") == order


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_a_line_of_the_table_is_one_effect_for_the_rig_and_for_the_model(name):
    effect = EFFECTS[name]
    shape = effect.shape(generator(3, name), MOTION)
    if "side" in shape:
        shape["side"] = -1.0
    law = effect.law(0.5 * effect.most(MOTION), shape)
    absent = element_of(name, shape, SCALES)
    element = element_of(name, shape, SCALES, 0.5 * effect.most(MOTION))
    assert law.name == name == absent.name
    assert float(getattr(absent, absent.strength)) == 0.0
    assert effect.signed <= absent.signed
    assert all(other in CATALOGUE for other in (*effect.exact, *effect.near, *effect.known_by))
    if isinstance(law, rig.Law) and not law.inner and not law.inertia:
        law = law.placed(rig.Stretch(0.5, 1.0, 2.0), np.random.default_rng(0))
        clock = {"clock": jnp.asarray(0.625)} if element.channels else {}
        for x, v in ((9e-4, 0.02), (-9e-4, 0.03), (3e-5, -0.025), (-3e-5, -0.01)):
            sides = tuple(math.copysign(1.0, switch(x, v, ())) for switch in law.switches)
            state = jnp.asarray(x), jnp.asarray(v)
            told = element.force(*state, ()) + (element.channel_force(*state, clock) if clock else 0.0)
            assert law.force(0.5, x, v, (), sides) == pytest.approx(float(told), rel=1e-4, abs=1e-6)


INSTRUMENTS = ("ac_coupling",)
MEMORIES = [name for name in sorted(EFFECTS) if CATALOGUE[name].internal_states and name not in INSTRUMENTS]


@pytest.mark.parametrize("name", MEMORIES)
def test_a_memory_of_the_table_is_one_for_the_rig_and_for_the_model(name):
    """Driven along one motion, by SciPy and from rest, both end with one force."""
    effect = EFFECTS[name]
    shape = effect.shape(generator(3, name), MOTION)
    law = effect.law(0.5 * effect.most(MOTION), shape)
    element = element_of(name, shape, SCALES, 0.5 * effect.most(MOTION))
    compiled = eqx.filter_jit(element.state_rate)

    def motion(t):
        return 1e-3 * np.sin(31.0 * t), 0.031 * np.cos(31.0 * t)

    def sides(x, v, z):
        return [1.0 if switch(x, v, z) >= 0.0 else -1.0 for switch in law.switches]

    def of_rig(t, z):
        return law.rate(t, *motion(t), z, sides(*motion(t), z))

    def of_model(t, s):
        x, v = motion(t)
        return compiled(jnp.asarray(x), jnp.asarray(v), tuple(map(jnp.asarray, s)))

    end = 0.7
    options = {"method": "LSODA", "rtol": 1e-7, "atol": 1e-12, "max_step": 2e-3}
    z, s = (
        integrate.solve_ivp(rate, (0.0, end), np.zeros(states), **options).y[:, -1]
        for rate, states in ((of_rig, law.inner), (of_model, element.internal_states))
    )
    x, v = motion(end)
    told = float(element.force(jnp.asarray(x), jnp.asarray(v), tuple(map(jnp.asarray, s))))
    # The few branches of the fractional law forget their start otherwise than the many of the rig.
    close = 1e-2 if name == "fractional_damping" else 1e-4
    assert law.force(end, x, v, z, sides(x, v, z)) == pytest.approx(told, rel=close)


def test_the_coverage_run_has_ten_effects_that_can_be_drawn():
    assert len(set(COMMONEST)) == 10
    assert set(COMMONEST) <= set(EFFECTS)


@pytest.mark.parametrize("name", sorted(OUTSIDE))
def test_a_law_outside_the_catalogue_is_as_strong_as_told_and_has_no_name_in_it(name):
    law = OUTSIDE[name](generator(4, name), MOTION, 5.0)
    assert law.name == name
    assert name not in CATALOGUE
    phase = np.linspace(0.0, 2 * np.pi, 2001)[:-1]
    x, v = MOTION.displacement * np.sin(phase), MOTION.displacement * MOTION.angular * np.cos(phase)
    sides = [np.where(switch(x, v, ()) >= 0.0, 1.0, -1.0) for switch in law.switches]
    force = np.broadcast_to(law.force(np.linspace(0.0, 30.0, 2000), x, v, (), sides), x.shape)
    assert 0.5 * 5.0 < np.max(np.abs(force)) < 1.3 * 5.0


def _row(seed, kind, truth, findings, **more):
    errors = {"before": {"fit": 1.5, "holdout": 2.0}, "after": {"fit": 1.0, "holdout": 1.1}}
    return {
        "seed": seed,
        "kind": kind,
        "task": "loop",
        "layout": "stepped",
        "truth": [{"effect": name, "size": 1.0, "limits": limits, "shape": {}} for name, limits in truth],
        "findings": [
            {"effect": one[0], "set": list(one), "signed": True, "strength": 1.0} for one in findings
        ],
        "verdict": "found" if findings else "none",
        "oracle": {"fit": 1.0, "holdout": 1.0},
        "oracle_converged": True,
        "off": {},
        "seconds": 5.0,
        **errors,
        **more,
    }


def test_a_left_out_effect_must_be_owned_up_to_or_named_by_a_name_it_is_known_by():
    hidden = (("coulomb_friction", 9.0),)
    rows = [
        _row(0, "one", hidden, (), verdict="unexplained") | {"task": "leave_out"},
        _row(1, "one", hidden, (("stribeck_friction",),)) | {"task": "leave_out"},
        _row(2, "one", hidden, (("input_delay",),)) | {"task": "leave_out"},
        _row(3, "one", hidden, (), verdict="none") | {"task": "leave_out"},
    ]
    assert _figure(rows, "left out").figure == 0.5


def test_a_line_that_was_cut_short_is_run_again(tmp_path):
    file = tmp_path / "trial.jsonl"
    file.write_text('{"seed": 1, "task": "loop"}\n{"seed": 2, "ta', encoding="utf-8")
    assert [row["seed"] for row in read(file)] == [1]


def _figure(rows, words):
    return next(mark for mark in table(rows) if mark.criterion.startswith(words))


def test_the_table_counts_what_it_says():
    gains = ("added_mass", "input_gain", "sensor_gain")
    rows = [
        _row(0, "none", (), ()),
        _row(1, "none", (), (("input_delay",),)),
        _row(2, "one", (("coulomb_friction", 9.0),), (("coulomb_friction", "dahl_friction"),)),
        _row(3, "one", (("coulomb_friction", 9.0),), (("dahl_friction", "coulomb_friction"),)),
        _row(4, "one", (("coulomb_friction", 1.5),), ()),
        _row(5, "one", (("input_gain", 9.0),), (("added_mass", "input_gain"),)),
        _row(6, "two", (("input_gain", 9.0), ("input_delay", 4.0)), (("input_delay",), gains)),
        _row(7, "two", (("input_gain", 9.0), ("input_delay", 4.0)), (gains,)),
        _row(8, "outside", (("detent", float("nan")),), (), verdict="unexplained"),
        {"seed": 9, "kind": "one", "task": "loop", "error": "ValueError: no"},
    ]
    assert _figure(rows, "an effect named").figure == 0.5
    assert _figure(rows, "an effect named").passed is False
    assert _figure(rows, "right family").figure == 0.5
    assert _figure(rows, "right family").judged == 4
    assert _figure(rows, "truth in").figure == 1.0
    assert _figure(rows, "median size").figure == 2.0
    assert _figure(rows, "exact classes").figure == 0.0
    assert _figure(rows, "outside").figure == 1.0
    assert _figure(rows, "two effects").figure == 0.5
    assert _figure(rows, "held-out excess").figure == pytest.approx(0.9)
    assert _figure(rows, "inadmissible sign").passed is True
    rows[2]["findings"][0] |= {"signed": False, "strength": -1.0}
    assert _figure(rows, "inadmissible sign").passed is False
