"""The same samples come back from every file format, in SI."""

import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

from isojax import read_campaign

Channels = dict[str, np.ndarray]
Tiny = Callable[..., Path]


def write_h5(file: Path, channels: Channels) -> None:
    with h5py.File(file, "w") as handle:
        for name, samples in channels.items():
            handle[name] = samples


def write_mat_73(file: Path, channels: Channels) -> None:
    with h5py.File(file, "w", userblock_size=512) as handle:
        for name, samples in channels.items():
            handle[name] = samples[None, :]
            handle[name].attrs["MATLAB_class"] = np.bytes_("double")
    with file.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def write_semicolons(file: Path, channels: Channels) -> None:
    rows = np.column_stack(list(channels.values()))
    lines = [";".join(f"{value:.9g}".replace(".", ",") for value in row) for row in rows]
    file.write_text("\ufeff" + ";".join(channels) + "\r\n" + "\r\n".join(lines) + "\r\n", encoding="utf-8")


def write_numpy_text(file: Path, channels: Channels) -> None:
    np.savetxt(file, np.column_stack(list(channels.values())), delimiter=",", header=",".join(channels))


def write_universal(file: Path, channels: Channels) -> None:
    pyuff = pytest.importorskip("pyuff")
    sets = [
        pyuff.prepare_58(
            binary=0,
            func_type=1,
            rsp_node=1,
            rsp_dir=1,
            ref_node=1,
            ref_dir=1,
            data=samples,
            x=channels["time"],
            id1=name,
            rsp_ent_name=name[:10],
            abscissa_spacing=1,
            abscissa_spec_data_type=17,
            ordinate_spec_data_type=12,
            orddenom_spec_data_type=0,
            ord_data_type=4,
            return_full_dict=True,
        )
        for name, samples in channels.items()
    ]
    for one in sets:
        one.update(abscissa_inc=0.005, abscissa_min=0.0, num_pts=2000)
        texts = ("lab", "name", "id2", "id3", "id4", "id5")
        one.update({key: "NONE" if key.endswith(texts) else 0 for key, value in one.items() if value is None})
    pyuff.UFF(str(file)).write_sets(sets, "overwrite")


def write_tdms(file: Path, channels: Channels) -> None:
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(str(file)) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("bench", name, samples, properties={"wf_increment": 0.005})
                for name, samples in channels.items()
            ]
        )


FORMATS = {
    ".npz": lambda file, channels: np.savez(file, **channels),
    ".mat": lambda file, channels: scipy.io.savemat(file, channels, oned_as="column"),
    "_73.mat": write_mat_73,
    "_compressed.mat": lambda file, channels: scipy.io.savemat(file, channels, do_compression=True),
    ".h5": write_h5,
    ".hdf5": write_h5,
    "_german.csv": write_semicolons,
    "_numpy.csv": write_numpy_text,
    ".uff": write_universal,
    ".unv": write_universal,
    ".tdms": write_tdms,
}


@pytest.mark.parametrize("ending", FORMATS)
def test_every_format_gives_the_same_samples(ending: str, tiny: Tiny, channels: Channels) -> None:
    folder = tiny(("run.csv", f"run{ending}"))
    FORMATS[ending](folder / f"run{ending}", channels)
    record = read_campaign(folder).records[0]
    np.testing.assert_allclose(record.input, channels["force"], rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(record.output, channels["acceleration"], rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(record.time, np.arange(2000) / 200.0, rtol=1e-12)


def test_an_hdf5_path_is_a_column_name(tiny: Tiny, channels: Channels) -> None:
    folder = tiny(("run.csv", "run.h5"), ('"force"\nunit', '"/bench/load cell"\nunit'))
    with h5py.File(folder / "run.h5", "w") as handle:
        handle["bench/load cell"] = channels["force"]
        handle["acceleration"] = channels["acceleration"]
    np.testing.assert_array_equal(read_campaign(folder).records[0].input, channels["force"])


@pytest.mark.parametrize("ending", [".uff", ".tdms"])
def test_a_file_that_states_its_rate_needs_none_declared(ending: str, tiny: Tiny, channels: Channels) -> None:
    folder = tiny(("run.csv", f"run{ending}"), (r"\[sampling\]\nrate = 200.0\n", ""))
    FORMATS[ending](folder / f"run{ending}", channels)
    assert read_campaign(folder).rate == pytest.approx(200.0, rel=1e-9)


@pytest.mark.parametrize("ending", [".uff", ".tdms"])
def test_a_declared_rate_that_contradicts_the_file_is_refused(
    ending: str, tiny: Tiny, channels: Channels
) -> None:
    folder = tiny(("run.csv", f"run{ending}"), ("rate = 200.0", "rate = 250.0"))
    FORMATS[ending](folder / f"run{ending}", channels)
    with pytest.raises(ValueError, match=r"rate says 250 Hz, but the file's own time base says 200 Hz"):
        read_campaign(folder)


@pytest.mark.parametrize(("ending", "module"), [(".uff", "pyuff"), (".tdms", "nptdms")])
def test_a_missing_extra_is_named(
    ending: str, module: str, tiny: Tiny, channels: Channels, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tiny(("run.csv", f"run{ending}"))
    FORMATS[ending](folder / f"run{ending}", channels)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ValueError, match=r'needs the package .*: python -m pip install "isojax\[io\]"$'):
        read_campaign(folder)


def test_a_universal_file_with_stray_carriage_returns_is_read(tiny: Tiny, channels: Channels) -> None:
    folder = tiny(("run.csv", "run.uff"))
    write_universal(folder / "run.uff", channels)
    clean = (folder / "run.uff").read_bytes()
    (folder / "run.uff").write_bytes(clean.replace(b"\r\n", b"\n").replace(b"\n", b"\r\r\n"))
    np.testing.assert_allclose(
        read_campaign(folder).records[0].input, channels["force"], rtol=1e-8, atol=1e-8
    )


def _shifted_tdms(file: Path, channels: Channels, properties: dict) -> None:
    nptdms = pytest.importorskip("nptdms")
    base = {"wf_increment": 0.005, "wf_start_time": np.datetime64("2026-01-01T00:00:00.000000")}
    with nptdms.TdmsWriter(str(file)) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("bench", "force", channels["force"], properties=base),
                nptdms.ChannelObject(
                    "bench", "acceleration", channels["acceleration"][3:], properties={**base, **properties}
                ),
            ]
        )


@pytest.mark.parametrize(
    "late",
    [
        {"wf_start_offset": 0.015},
        {"wf_start_time": np.datetime64("2026-01-01T00:00:00.015000")},
        {"wf_start_time": np.datetime64("2026-01-01T00:00:00.010000"), "wf_start_offset": 0.005},
    ],
)
def test_tdms_channels_that_start_whole_samples_apart_are_aligned(
    late: dict, tiny: Tiny, channels: Channels
) -> None:
    folder = tiny(("run.csv", "run.tdms"))
    _shifted_tdms(folder / "run.tdms", channels, late)
    record = read_campaign(folder).records[0]
    np.testing.assert_array_equal(record.input, channels["force"][3:])
    np.testing.assert_array_equal(record.output, channels["acceleration"][3:])


def test_tdms_channels_that_start_half_a_sample_apart_are_refused(tiny: Tiny, channels: Channels) -> None:
    folder = tiny(("run.csv", "run.tdms"))
    _shifted_tdms(folder / "run.tdms", channels, {"wf_start_offset": 0.0175})
    with pytest.raises(ValueError, match=r"`acceleration` starts 3\.500 samples after `force`"):
        read_campaign(folder)


UNITS = {
    ("N", "m/s^2"): (1.0, 1.0),
    ("kN", "mm/s^2"): (1e3, 1e-3),
    ("lbf", "g"): (4.4482216152605, 9.80665),
    ("kgf", "m/s2"): (9.80665, 1.0),
    ("mN", "m/s²"): (1e-3, 1.0),
    ("V", "m/s**2"): (1.0, 1.0),
    ("mV", "in/s^2"): (1e-3, 0.0254),
}


@pytest.mark.parametrize("units", UNITS)
def test_units_become_si(units: tuple[str, str], tiny: Tiny, channels: Channels) -> None:
    force, acceleration = UNITS[units]
    folder = tiny(('unit = "N"', f'unit = "{units[0]}"'), (r'unit = "m/s\^2"', f'unit = "{units[1]}"'))
    record = read_campaign(folder).records[0]
    np.testing.assert_allclose(record.input, force * channels["force"], rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(record.output, acceleration * channels["acceleration"], rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize(
    ("quantity", "unit", "factor"),
    [
        ("velocity", "in/s", 0.0254),
        ("velocity", "mm/s", 1e-3),
        ("displacement", "um", 1e-6),
        ("displacement", "µm", 1e-6),
        ("displacement", "mm", 1e-3),
        ("displacement", "mV", 1e-3),
    ],
)
def test_outputs_of_every_quantity_become_si(
    quantity: str, unit: str, factor: float, tiny: Tiny, channels: Channels
) -> None:
    folder = tiny(('quantity = "acceleration"', f'quantity = "{quantity}"'), (r'"m/s\^2"', f'"{unit}"'))
    campaign = read_campaign(folder)
    np.testing.assert_allclose(
        campaign.records[0].output, factor * channels["acceleration"], rtol=1e-7, atol=1e-7
    )
    assert campaign.output.quantity == quantity


@pytest.mark.parametrize(
    ("declared", "factor"),
    [
        ('quantity = "reaction_mass_acceleration"\nmoving_mass = 3.0\nunit = "m/s^2"', -3.0),
        (
            'quantity = "reaction_mass_acceleration"\nmoving_mass = 3.0\nunit = "g"\ngain = 2.0',
            -6.0 * 9.80665,
        ),
        ('quantity = "base_acceleration"\nunit = "mm/s^2"\ngain = 2.0', 2e-3),
        ('quantity = "command"\nunit = "V"\ngain = 35.0', 35.0),
        ('quantity = "command"\nunit = "mA"\ngain = 35.0', 35e-3),
    ],
)
def test_the_force_comes_from_whatever_was_recorded(
    declared: str, factor: float, tiny: Tiny, channels: Channels
) -> None:
    folder = tiny(('quantity = "force"\n', ""), ('unit = "N"', declared))
    np.testing.assert_allclose(
        read_campaign(folder).records[0].input, factor * channels["force"], rtol=1e-7, atol=1e-6
    )


def test_every_field_of_a_record_arrives(tiny: Tiny) -> None:
    fields = 'role = "holdout"\nlevel = 60\ndirection = "backward"\nrepeat = 2\n'
    fields += "start = 100\nstop = 900\nsettle = 9\n"
    more = f'role = "fit"\nstart = 900\nperiod = 200\n[[record]]\nfile = "run.csv"\n{fields}'
    campaign = read_campaign(tiny(('role = "fit"\n', more)) / "campaign.toml")
    first, second = campaign.records
    assert (first.kind, first.period, first.input.size) == ("periodic", 200, 1100)
    assert (second.level, second.direction, second.repeat, second.settle) == (60.0, "backward", 2, 9)
    assert campaign.fit_records == (first,)
    assert campaign.holdout_records == (second,)
    assert (campaign.stiffness, campaign.damping, campaign.elements) == (("linear",), ("linear",), ())
    assert campaign.title == "tiny"
