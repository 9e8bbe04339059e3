"""Nonsense is named before a fit: campaigns of the simulated rig, each with one mistake."""

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from isojax import fit, read_campaign, rig
from isojax.demo import campaign_folder
from isojax.identification import classical_guess
from isojax.records import Campaign, Suspicion, find_suspicions

HEAVY = rig.Plant(rig.base_laws(1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6))
LIGHT = rig.Plant((rig.LinearStiffness(8e4), rig.CubicStiffness(3e10), rig.LinearDamping(25.0)), mass=5.0)
DWELLS = tuple((5000.0 / np.array([1250, 1160, 1080, 1010, 950, 900, 850, 800])).tolist())
PLANS = {
    "dwells": (HEAVY, rig.SteppedSine((50.0, 140.0), DWELLS, 20, ("forward",)), 250.0, 1.0),
    "sweep": (HEAVY, rig.SweptSine((50.0, 140.0), 4.0, 6.4, 0.1, ("forward",)), 250.0, 1.0),
    "multisine": (LIGHT, rig.Multisine((3.0, 9.0), 5.0, 60.0, 4.0, 3), 500.0, 0.05),
}
NOISE = {"acceleration": 0.01, "velocity": 3e-4, "displacement": 1e-5}
UNIT = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m"}

Channels = dict[str, np.ndarray]
Spoil = Callable[[Channels], Channels]


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Path]:
    """Gives the folder of a campaign that is declared as it was measured."""
    made: dict[tuple[str, str], Path] = {}

    def make(plan: str, output: str) -> Path:
        if (plan, output) not in made:
            plant, trials, rate, quiet = PLANS[plan]
            bench = rig.Bench(rate, output, quiet * NOISE[output], 0.02, anti_alias=False, tolerance=1e-6)
            folder = tmp_path_factory.mktemp(f"{plan}_{output}")
            names = ("linear_stiffness", "cubic_stiffness", "linear_damping")
            rig.write_campaign(folder, plant, trials, 7, plan, bench, declared=names)
            made[plan, output] = folder
        return made[plan, output]

    return make


@pytest.fixture
def spoiled(tmp_path: Path) -> Callable[..., Path]:
    """Writes a campaign again, with its data or regular expressions of its .toml changed."""

    def write(folder: Path, *changes: tuple[str, str], data: Spoil | None = None) -> Path:
        for file in folder.iterdir():
            if file.suffix == ".npz":
                channels = {name: value.astype(float) for name, value in np.load(file).items()}
                np.savez(tmp_path / file.name, **(channels if data is None else data(channels)))
            else:
                text = file.read_text(encoding="utf-8")
                for pattern, new in changes if file.name == "campaign.toml" else ():
                    text, count = re.subn(pattern, new, text, count=1, flags=re.M)
                    assert count == 1, pattern
                (tmp_path / file.name).write_text(text, encoding="utf-8")
        return tmp_path

    return write


def times(name: str, factor: float) -> Spoil:
    return lambda channels: {**channels, name: factor * channels[name]}


def late(name: str, samples: int) -> Spoil:
    def shift(channels: Channels) -> Channels:
        signal = channels[name]
        return {**channels, name: np.concatenate([np.full(samples, signal[0]), signal[:-samples]])}

    return shift


def skewed(name: str, skew: float) -> Spoil:
    def run(channels: Channels) -> Channels:
        place = np.arange(channels[name].size)
        seen = np.clip(place / (1.0 + skew), 0, place[-1])
        return {**channels, name: CubicSpline(place, channels[name])(seen)}

    return run


def based(output: str, mass: float) -> Spoil:
    """The same motion, driven by the base: F = -m a_base; an acceleration output is then the absolute one."""

    def drive(channels: Channels) -> Channels:
        base = -channels["force"] / mass
        moved = channels[output] + (base if output == "acceleration" else 0.0)
        return {"force": base, output: moved}

    return drive


BASED = (('quantity = "force"', 'quantity = "base_acceleration"'), ('unit = "N"', 'unit = "m/s^2"'))


def first(campaign: Campaign) -> Suspicion:
    return find_suspicions(campaign)[0]


def names(campaign: Campaign) -> list[str]:
    """Short names of the causes of what contradicts the declaration, the likeliest first."""
    return [cause.name for one in find_suspicions(campaign) if one.contradicts for cause in one.causes]


EVERY = [(plan, output) for plan in PLANS for output in UNIT]
SOME = list(zip(PLANS, UNIT, strict=True))


@pytest.mark.parametrize(("plan", "output"), EVERY)
def test_a_right_campaign_passes(right, spoiled, plan, output):
    assert find_suspicions(read_campaign(right(plan, output))) == ()
    mass = PLANS[plan][0].mass
    assert (
        find_suspicions(read_campaign(spoiled(right(plan, output), *BASED, data=based(output, mass)))) == ()
    )


@pytest.mark.parametrize(("plan", "output"), EVERY)
def test_swapped_columns_are_named(right, spoiled, plan, output):
    changes = ('column = "force"', "column = 1"), (f'column = "{output}"', 'column = "force"')
    folder = spoiled(right(plan, output), *changes, ("column = 1", f'column = "{output}"'))
    assert names(read_campaign(folder))[0] == "channels swapped"
    assert '[input] column = "force"' in first(read_campaign(folder)).causes[0].line


@pytest.mark.parametrize(("plan", "output"), EVERY)
@pytest.mark.parametrize("channel", ["input", "output"])
def test_a_wrong_sign_is_named(right, spoiled, plan, output, channel):
    column = "force" if channel == "input" else output
    campaign = read_campaign(spoiled(right(plan, output), data=times(column, -1.0)))
    assert names(campaign) == ["sign"]
    assert first(campaign).causes[0].line == "[input] gain = -1"


def test_one_odd_record_among_right_ones_is_named_whatever_its_role():
    campaign = read_campaign(campaign_folder())
    assert find_suspicions(campaign) == ()
    assert {record.role for record in campaign.records} == {"fit", "holdout"}
    for place in (0, next(i for i, one in enumerate(campaign.records) if one.role == "holdout")):
        record = campaign.records[place]
        flipped = dataclasses.replace(record, input=-record.input)
        records = (*campaign.records[:place], flipped, *campaign.records[place + 1 :])
        (found,) = find_suspicions(dataclasses.replace(campaign, records=records))
        assert (found.where, found.contradicts) == (record.name, True)
        assert [cause.name for cause in found.causes] == ["sign of one record"]


@pytest.mark.parametrize(("plan", "output"), SOME)
@pytest.mark.parametrize(("factor", "line"), [(1e-3, 'unit = "kN"'), (1 / 9.80665, 'unit = "kgf"')])
def test_a_force_in_another_unit_is_named(right, spoiled, plan, output, factor, line):
    campaign = read_campaign(spoiled(right(plan, output), data=times("force", factor)))
    assert names(campaign)[0] == "input unit"
    assert first(campaign).causes[0].line == f"[input] {line}"


@pytest.mark.parametrize(("plan", "output"), SOME)
@pytest.mark.parametrize("unit", ["kN", "kgf"])
def test_newtons_declared_in_another_unit_are_named(right, spoiled, plan, output, unit):
    campaign = read_campaign(spoiled(right(plan, output), ('unit = "N"', f'unit = "{unit}"')))
    assert names(campaign)[0] == "input unit"
    assert first(campaign).causes[0].line == '[input] unit = "N"'


@pytest.mark.parametrize(("plan", "output"), SOME)
def test_a_mass_in_grams_and_a_mass_twice_as_large_are_named(right, spoiled, plan, output):
    mass = PLANS[plan][0].mass
    campaign = read_campaign(spoiled(right(plan, output), ("^mass = .*", f"mass = {1e3 * mass}")))
    assert names(campaign)[0] == "mass unit"
    assert first(campaign).causes[0].line == f"[campaign] mass = {mass:g}"
    campaign = read_campaign(spoiled(right(plan, output), ("^mass = .*", f"mass = {2.0 * mass}")))
    assert "mass or gain" in names(campaign)
    assert float(re.findall(r"mass = ([\d.]+)", str(first(campaign)))[0]) == pytest.approx(mass, rel=0.03)


@pytest.mark.parametrize("plan", PLANS)
@pytest.mark.parametrize(
    ("output", "factor", "unit"),
    [("displacement", 1e3, "mm"), ("velocity", 1e3, "mm/s"), ("acceleration", 1 / 9.80665, "g")],
)
def test_an_output_in_another_unit_is_named(right, spoiled, plan, output, factor, unit):
    campaign = read_campaign(spoiled(right(plan, output), data=times(output, factor)))
    assert names(campaign)[0] == "output unit"
    assert first(campaign).causes[0].line == f'[output] unit = "{unit}"'


@pytest.mark.parametrize(("plan", "output"), SOME)
@pytest.mark.parametrize("declared", UNIT)
def test_another_quantity_of_the_output_is_named(right, spoiled, plan, output, declared):
    if declared == output:
        return
    changes = (
        (f'quantity = "{output}"', f'quantity = "{declared}"'),
        (
            re.escape(f'unit = "{UNIT[output]}"'),
            f'unit = "{UNIT[declared]}"',
        ),
    )
    campaign = read_campaign(spoiled(right(plan, output), *changes))
    assert names(campaign)[0] == "output quantity"
    assert f'quantity = "{output}"' in first(campaign).causes[0].line


@pytest.mark.parametrize(("plan", "output"), SOME)
def test_another_quantity_of_the_input_is_named(right, spoiled, plan, output):
    campaign = read_campaign(spoiled(right(plan, output), *BASED))
    assert names(campaign)[0] == "input quantity"
    reaction = 'quantity = "reaction_mass_acceleration"\nmoving_mass = 12.0'
    campaign = read_campaign(spoiled(right(plan, output), ('quantity = "force"', reaction), BASED[1]))
    assert names(campaign)[0] == "input quantity"
    assert 'quantity = "force"' in first(campaign).causes[0].line


@pytest.mark.parametrize(("plan", "output"), SOME)
@pytest.mark.parametrize("channel", ["input", "output"])
def test_a_long_delay_is_named_with_its_length(right, spoiled, plan, output, channel):
    column = "force" if channel == "input" else output
    campaign = read_campaign(spoiled(right(plan, output), data=late(column, 15)))
    assert names(campaign)[0] == "delay"
    found = first(campaign).causes[0]
    assert f'"{column}" is recorded' in found.words
    samples = float(re.findall(r"by ([\d.]+) samples", found.line)[0])
    assert samples == pytest.approx(15.0, abs=0.3)


@pytest.mark.parametrize(("plan", "output"), SOME)
@pytest.mark.parametrize("skew", [3e-3, -3e-3])
def test_a_large_clock_skew_is_named(right, spoiled, plan, output, skew):
    campaign = read_campaign(spoiled(right(plan, output), data=skewed(output, skew)))
    assert names(campaign)[0] == "clock skew"


@pytest.mark.parametrize("plan", PLANS)
def test_a_wrong_rate_shows_where_the_output_is_no_acceleration(right, spoiled, plan):
    if plan == "dwells":
        with pytest.raises(ValueError, match="schedule"):
            read_campaign(spoiled(right(plan, "displacement"), ("^rate = .*", "rate = 500.0")))
        return
    rate = PLANS[plan][2]
    for output in ("displacement", "velocity"):
        campaign = read_campaign(spoiled(right(plan, output), ("^rate = .*", f"rate = {2.0 * rate}")))
        assert "rate" in names(campaign)
        assert any(cause.line == f"[sampling] rate = {rate:g}" for cause in first(campaign).causes)


@pytest.mark.parametrize("output", UNIT)
def test_milliseconds_read_as_seconds_are_named(right, spoiled, output):
    campaign = read_campaign(spoiled(right("sweep", output), ("^rate = .*", "rate = 0.25")))
    assert "rate" in names(campaign)
    assert "milliseconds" in str(first(campaign))


@pytest.mark.parametrize("plan", ["dwells", "sweep"])
def test_mistakes_under_base_excitation_are_named(right, spoiled, plan):
    folder = right(plan, "acceleration")
    drive = based("acceleration", HEAVY.mass)
    wrong: dict[str, Spoil] = {
        "sign": lambda channels: times("force", -1.0)(drive(channels)),
        "output unit": lambda channels: times("acceleration", 1 / 9.80665)(drive(channels)),
        "delay": lambda channels: late("force", 15)(drive(channels)),
    }
    for name, spoil in wrong.items():
        assert names(read_campaign(spoiled(folder, *BASED, data=spoil)))[0] == name
    changes = ('column = "force"', "column = 1"), ('column = "acceleration"', 'column = "force"')
    back = ("column = 1", 'column = "acceleration"')
    assert names(read_campaign(spoiled(folder, *BASED, *changes, back, data=drive)))[0] == "channels swapped"


def test_a_free_mass_or_gain_relaxes_the_scale_and_not_the_sign(right, spoiled):
    folder, heavier = right("dwells", "acceleration"), ("^mass = .*", "mass = 2400.0\nmass_free = true")
    assert find_suspicions(read_campaign(spoiled(folder, heavier))) == ()
    free = ('unit = "N"', 'unit = "N"\ngain = 30.0\ngain_free = true')
    (doubt,) = find_suspicions(read_campaign(spoiled(folder, free)))
    assert not doubt.contradicts
    assert names(read_campaign(spoiled(folder, heavier, data=times("force", -1.0)))) == ["sign"]


def test_a_command_has_no_scale(right, spoiled):
    changes = ('quantity = "force"', 'quantity = "command"'), ('unit = "N"', 'unit = "kN"')
    assert find_suspicions(read_campaign(spoiled(right("dwells", "acceleration"), *changes))) == ()


def test_clipped_tops_are_a_doubt(right, spoiled):
    clip = lambda channels: {**channels, "acceleration": np.clip(channels["acceleration"], -0.2, 0.2)}  # noqa: E731
    (doubt,) = find_suspicions(read_campaign(spoiled(right("dwells", "acceleration"), data=clip)))
    assert (doubt.check, doubt.contradicts) == ("flat tops", False)
    assert "0.2" in doubt.figure


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_a_converter_at_the_end_of_its_range_is_a_doubt_and_coarse_steps_are_not(right, spoiled, bits):
    """Tops that are cut by a quarter, and the same steps with range enough, at 20 samples a half cycle."""
    folder = right("dwells", "acceleration")
    most = max(float(np.max(np.abs(np.load(file)["acceleration"]))) for file in folder.glob("*.npz"))

    def converted(reach: float) -> Spoil:
        step = reach / 2 ** (bits - 1)

        def convert(channels: Channels) -> Channels:
            cut = np.clip(np.round(channels["acceleration"] / step) * step, -reach, reach - step)
            return {**channels, "acceleration": cut}

        return convert

    assert find_suspicions(read_campaign(spoiled(folder, data=converted(1.01 * most)))) == ()
    found = find_suspicions(read_campaign(spoiled(folder, data=converted(0.75 * most))))
    assert [(one.check, one.contradicts) for one in found] == [("flat tops", False)]
    assert re.search(r"exactly at an end of the range, .* in SI .*, in [12] of 2 records", found[0].figure)


def test_scattered_sample_times_are_a_doubt_and_rounded_ones_are_not(right, spoiled):
    draw = np.random.default_rng(5)

    def timed(scatter: float, decimals: int) -> Spoil:
        def add(channels: Channels) -> Channels:
            even = np.arange(channels["force"].size) / 250.0
            return {**channels, "t": np.round(even + scatter * draw.standard_normal(even.size), decimals)}

        return add

    clock = ("^rate = .*", 'time = "t"')
    folder = right("sweep", "acceleration")
    assert find_suspicions(read_campaign(spoiled(folder, clock, data=timed(0.0, 3)))) == ()
    (doubt,) = find_suspicions(read_campaign(spoiled(folder, clock, data=timed(7e-5, 7))))
    assert (doubt.check, doubt.contradicts) == ("sample times", False)
    assert "0.071 ms" in doubt.figure


def test_noise_as_large_as_the_response_is_not_taken_for_a_mistake(tmp_path):
    bench = rig.Bench(500.0, noise=0.5, anti_alias=False, tolerance=1e-6)
    rig.write_campaign(tmp_path, LIGHT, rig.Multisine((2.0,), 5.0, 60.0, 4.0, 3), 3, "noisy", bench)
    assert all(
        one.check == "balance" and not one.contradicts for one in find_suspicions(read_campaign(tmp_path))
    )


def test_the_sign_of_a_blow_is_named(tmp_path):
    bench = rig.Bench(2000.0, noise=1e-3, anti_alias=False, tolerance=1e-6)
    plan = rig.Impulse((50.0, 100.0), 0.02, 3.0)
    rig.write_campaign(tmp_path, LIGHT, plan, 3, "blows", bench)
    assert find_suspicions(read_campaign(tmp_path)) == ()
    file = tmp_path / "campaign.toml"
    file.write_text(file.read_text().replace('unit = "N"', 'unit = "N"\ngain = -1.0'))
    assert names(read_campaign(tmp_path)) == ["sign"]


def test_free_decays_alone_say_nothing(tmp_path):
    bench = rig.Bench(500.0, noise=1e-3, anti_alias=False, tolerance=1e-6)
    rig.write_campaign(tmp_path, LIGHT, rig.FreeDecay((1e-3,), 2.0), 3, "released", bench)
    assert find_suspicions(read_campaign(tmp_path)) == ()


def test_a_contradiction_stops_the_fit_unless_it_is_wanted_anyway(right, spoiled):
    campaign = read_campaign(spoiled(right("dwells", "acceleration"), data=times("force", -1.0)))
    model = classical_guess(campaign).model
    with pytest.raises(ValueError, match=r"contradict.*wrong sign.*gain = -1.*anyway"):
        fit(model, campaign)
    assert fit(model, campaign, max_steps=1, anyway=True).campaign is campaign
