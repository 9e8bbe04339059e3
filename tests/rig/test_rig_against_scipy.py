"""The simulated plant against SciPy's integrators and force balances that are written out here."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from isojax import rig

K1, K2, K3, C1, C2, C3 = 1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6
MASS = 800.0
SECONDS = 2.0
TIMES = np.arange(0, SECONDS, 1e-3)
TONES = rig.Tones(0.0, SECONDS, 0.0, (180.0, 1.8, 1.1), (29.0, 58.0, 87.0), (0.0, 0.7, 1.9))


def tones(t):
    return 180 * np.sin(29 * t) + 1.8 * np.sin(58 * t + 0.7) + 1.1 * np.sin(87 * t + 1.9)


def base(x, v):
    return K1 * x + K2 * abs(x) * x + K3 * x**3 + C1 * v + C2 * abs(v) * v + C3 * v**3


def reference(force, extra, rates, start, seconds=SECONDS):
    """Motion by DOP853 in steps that are short against every kink, and the acceleration from the balance."""

    def balance(t, y):
        x, v, *z = y
        return [v, (force(t) - base(x, v) - extra(x, v, z)) / MASS, *rates(x, v, z)]

    times = TIMES[TIMES < seconds]
    result = solve_ivp(
        balance,
        (0, seconds),
        start,
        "DOP853",
        times,
        rtol=1e-12,
        atol=1e-15,
        max_step=1 / 1500,
        first_step=1e-6,
    )
    acceleration = np.array([balance(t, y)[1] for t, y in zip(times, result.y.T, strict=True)])
    return times, result.y[0], acceleration


def assert_same(plant, pieces, times, x, a, displacement=0.0):
    motion = rig.response(plant, pieces, times, displacement)
    assert np.std(motion["displacement"] - x) < 1e-7 * np.std(x)
    assert np.std(motion["acceleration"] - a) < 1e-7 * np.std(a)


LAWS = {
    "base alone": ((), lambda x, v, z: 0.0, lambda x, v, z: []),
    "quadratic stiffness": (
        (rig.QuadraticStiffness(-3e7),),
        lambda x, v, z: -3e7 * x**2,
        lambda x, v, z: [],
    ),
    "position damping": ((rig.PositionDamping(2e9),), lambda x, v, z: 2e9 * x**2 * v, lambda x, v, z: []),
    "Maxwell": (
        (rig.MaxwellBranch(1.5e4, 0.04),),
        lambda x, v, z: 1.5e4 * z[0],
        lambda x, v, z: [v - z[0] / 0.04],
    ),
    "Dahl": (
        (rig.DahlFriction(5.0, 1e5),),
        lambda x, v, z: z[0],
        lambda x, v, z: [1e5 * (v - abs(v) * z[0] / 5)],
    ),
    "Bouc-Wen, n = 1": (
        (rig.BoucWen(3e4, 800.0, -1100.0),),
        lambda x, v, z: 3e4 * z[0],
        lambda x, v, z: [v - 800 * abs(v) * z[0] + 1100 * v * abs(z[0])],
    ),
    "Bouc-Wen, n = 1.5": (
        (rig.BoucWen(3e4, 3e4, 1e4, 1.5),),
        lambda x, v, z: 3e4 * z[0],
        lambda x, v, z: [v - 3e4 * abs(v) * abs(z[0]) ** 0.5 * z[0] - 1e4 * v * abs(z[0]) ** 1.5],
    ),
    "Maxwell and Bouc-Wen at once": (
        (rig.MaxwellBranch(1.5e4, 0.04), rig.BoucWen(3e4, 800.0, 300.0)),
        lambda x, v, z: 1.5e4 * z[0] + 3e4 * z[1],
        lambda x, v, z: [v - z[0] / 0.04, v - 800 * abs(v) * z[1] - 300 * v * abs(z[1])],
    ),
}


@pytest.mark.parametrize("case", LAWS)
def test_smooth_and_hysteretic_laws_follow_scipy(case):
    laws, extra, rates = LAWS[case]
    inner = sum(law.inner for law in laws)
    times, x, a = reference(tones, extra, rates, [0.0] * (2 + inner))
    assert_same(rig.y_plant().plus(*laws), [TONES], times, x, a)


def test_duffing_oscillator_follows_scipy():
    plant = rig.Plant((rig.LinearStiffness(K1), rig.CubicStiffness(5e11), rig.LinearDamping(C1)), MASS)

    def balance(t, y):
        return [y[1], (tones(t) - K1 * y[0] - 5e11 * y[0] ** 3 - C1 * y[1]) / MASS]

    result = solve_ivp(balance, (0, SECONDS), [1e-3, 0.0], "DOP853", TIMES, rtol=1e-12, atol=1e-15)
    motion = rig.response(plant, [TONES], TIMES, displacement=1e-3)
    assert np.std(motion["displacement"] - result.y[0]) < 1e-8 * np.std(result.y[0])


def test_sweep_follows_scipy():
    sweep = rig.IDEAL_SHAKER.sweep(100.0, 4.0, 0.5, 0.0, SECONDS)
    times, x, a = reference(
        lambda t: 100 * np.sin(2 * np.pi * (4 * t + 0.25 * t**2)),
        lambda x, v, z: 0.0,
        lambda x, v, z: [],
        [0.0, 0.0],
    )
    assert_same(rig.y_plant(), [sweep], times, x, a)


def test_free_decay_follows_scipy():
    times, x, a = reference(lambda t: 0.0, lambda x, v, z: 0.0, lambda x, v, z: [], [1e-3, 0.0], seconds=1.0)
    assert_same(rig.y_plant(), [rig.Tones(0.0, SECONDS)], times, x, a, displacement=1e-3)


def sliding_and_sticking(friction, seconds):
    """Motion with dry friction, one SciPy run for each slide; rests are looked for on a grid of 10 us."""
    x = np.zeros(TIMES.size)
    t, state = 0.0, [0.0, 0.0]
    rests = 0

    def turned(t, y):
        return y[1]

    turned.terminal = True
    while t < seconds:
        net = tones(t) - base(state[0], 0.0)
        if abs(net) <= friction:
            rests += 1
            grid = np.arange(t, seconds, 1e-5)
            free = np.flatnonzero(np.abs(tones(grid) - base(state[0], 0.0)) > friction)
            until = seconds
            if free.size:
                until = brentq(
                    lambda t, x=state[0]: abs(tones(t) - base(x, 0.0)) - friction,
                    grid[free[0] - 1],
                    grid[free[0]],
                    xtol=1e-15,
                )
            x[(TIMES >= t) & (TIMES <= until)] = state[0]
            t, net = until, tones(until) - base(state[0], 0.0)
            if not free.size:
                break
        side = np.sign(net)
        turned.direction = -side

        def slide(t, y, side=side):
            return [y[1], (tones(t) - base(*y) - side * friction) / MASS]

        lift = t + 1e-9
        run = solve_ivp(
            slide,
            (lift, seconds),
            [state[0], side * 1e-15],
            "DOP853",
            dense_output=True,
            events=turned,
            rtol=1e-12,
            atol=1e-16,
            max_step=1 / 1500,
            first_step=1e-7,
        )
        now = (lift <= TIMES) & (run.t[-1] >= TIMES)
        x[now] = run.sol(TIMES[now])[0]
        t, state = run.t[-1], [run.y[0, -1], 0.0]
    return x, rests


@pytest.mark.parametrize("friction", [6.0, 130.0])
def test_sliding_and_sticking_follow_scipy(friction):
    x, rests = sliding_and_sticking(friction, 1.0)
    motion = rig.response(rig.y_plant().plus(rig.CoulombFriction(friction)), [TONES], TIMES)
    early = TIMES < 1
    assert rests >= (1 if friction < 50 else 5)
    assert np.std(motion["displacement"][early] - x[early]) < 2e-7 * np.std(x[early])


@pytest.mark.parametrize(
    "laws", [(), (rig.CoulombFriction(6.0),), (rig.CoulombFriction(60.0), rig.MaxwellBranch(1e5, 0.02))]
)
def test_default_tolerance_keeps_the_error_below_1e_7_of_the_response(laws):
    plant = rig.y_plant().plus(*laws)
    plan = rig.SteppedSine((150.0,), (4.0, 4.5, 5.0, 5.5), 5)
    (trial, _) = plan.trials(rig.EXAMPLE_SHAKER, 0)
    times = np.arange(0, trial.seconds, 1e-3)
    coarse = rig.response(plant, trial.pieces, times)
    fine = rig.response(plant, trial.pieces, times, tolerance=1e-13)
    for quantity in ("displacement", "velocity", "acceleration"):
        assert np.std(coarse[quantity] - fine[quantity]) < 1e-7 * np.std(fine[quantity])


def test_motion_that_runs_away_is_refused():
    softening = rig.Plant((rig.LinearStiffness(1e5), rig.CubicStiffness(-1e9)))
    with pytest.raises(RuntimeError, match="must stay finite"):
        rig.response(softening, [rig.Tones(0.0, 5.0, 0.0, (1e4,), (10.0,), (0.0,))], TIMES)


@pytest.mark.parametrize("case", range(6))
def test_any_mixture_of_laws_repeats_at_a_tighter_tolerance(case):
    draw = np.random.default_rng(case)
    candidates = [
        rig.CoulombFriction(10 ** draw.uniform(-1, 2)),
        rig.CoulombFriction(1.0),
        rig.MaxwellBranch(10 ** draw.uniform(3, 5), 10 ** draw.uniform(-2.5, -0.5)),
        rig.DahlFriction(10 ** draw.uniform(0, 1.5), 10 ** draw.uniform(4, 5.5)),
        rig.BoucWen(1e4, 10 ** draw.uniform(2, 4), draw.uniform(-500, 500), 1.0 + case % 2),
        rig.QuadraticStiffness(draw.uniform(-5e7, 5e7)),
    ]
    plant = rig.y_plant().plus(*(law for law in candidates if draw.random() < 0.6))
    (trial,) = rig.Multisine((20.0,), 2.0, 12.0, 2.0, 1, "full").trials(rig.IDEAL_SHAKER, case)
    coarse = rig.response(plant, trial.pieces, TIMES)
    fine = rig.response(plant, trial.pieces, TIMES, tolerance=1e-12)
    for quantity in ("displacement", "velocity", "acceleration"):
        assert np.std(coarse[quantity] - fine[quantity]) < 1e-7 * np.std(fine[quantity])
