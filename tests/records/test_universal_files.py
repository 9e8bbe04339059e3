"""Universal files in the wild: each is read, or refused with one clear error."""

from pathlib import Path

import numpy as np
import pytest

from isojax.records.reading._data_file import read_columns

pytest.importorskip("pyuff")
READ = {
    "Sample_UFF58_ascii.uff": ("Mic 01.0Scalar", 79292, 65536.0),
    "Sample_UFF58b_bin.uff": ("Mic 01.0Scalar", 79292, 65536.0),
    "binary8byte.uff": ("sine 5 Hz", 250, 100.0),
    "mpstd_set001.uff": ("MPS set1 Dof2", 222400, 3200.0),
    "time-history-not-all-columns-filled.uff": ("1x : m/s²", 13, 20000.0),
}
REFUSED = {
    "dataset_milestone_in_header.uff": "announces 2508876 samples, but 42 follow",
    "mesh_test_uff2412_mixed.uff": r"holds datasets \[15, 18, 2412\] only; expected a real time history",
    "testlab_161_164_18_15_82.uff": r"holds datasets \[15, 18, 82, 151, 164\] only",
    "non_ascii_header.uff": "holds spectra only",
    "sample_dataset58_psd.uff": "holds spectra only",
}


def test_no_file_of_the_set_is_forgotten(shared_data: Path) -> None:
    assert {file.name for file in (shared_data / "uff").glob("*.uff")} == {*READ, *REFUSED}


@pytest.mark.parametrize("name", READ)
def test_a_time_history_is_read(name: str, shared_data: Path) -> None:
    channel, size, rate = READ[name]
    column = read_columns(shared_data / "uff" / name, [channel])[channel]
    assert column.samples.size == size
    assert column.rate == pytest.approx(rate, rel=1e-5)
    assert np.all(np.isfinite(column.samples))


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_whole_time_history_is_refused(name: str, shared_data: Path) -> None:
    with pytest.raises(ValueError, match=REFUSED[name]) as caught:
        read_columns(shared_data / "uff" / name, ["PWL Mic"])
    assert name in str(caught.value)


def test_ascii_and_binary_of_one_record_agree(shared_data: Path) -> None:
    texts, binary = (
        read_columns(shared_data / "uff" / f"Sample_UFF58{kind}.uff", ["Mic 01"])["Mic 01"].samples
        for kind in ("_ascii", "b_bin")
    )
    np.testing.assert_allclose(texts, binary, rtol=1e-5, atol=1e-9)


def test_the_sine_of_the_file_is_one_of_five_hertz(shared_data: Path) -> None:
    column = read_columns(shared_data / "uff" / "binary8byte.uff", ["sine 5 Hz"])["sine 5 Hz"]
    lines = np.abs(np.fft.rfft(column.samples[:240]))
    assert np.argmax(lines[1:]) + 1 == 12


def test_a_name_that_two_channels_share_is_refused_with_names_that_do_not(shared_data: Path) -> None:
    with pytest.raises(
        ValueError, match=r"2 channels are called `1\+Z`; use one of `MPS set1 Dof1`, `MPS set1 Dof4`"
    ):
        read_columns(shared_data / "uff" / "mpstd_set001.uff", ["1+Z"])


def test_a_missing_channel_lists_those_present(shared_data: Path) -> None:
    with pytest.raises(ValueError, match=r"no column `Mic 02`; it has .*`Mic 01`"):
        read_columns(shared_data / "uff" / "Sample_UFF58_ascii.uff", ["Mic 02"])
