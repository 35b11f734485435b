"""TDMS: channels by name, their unit and sample rate against the manifest's."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from measured_files import write_tdms
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

from rtctl.border.errors import InputError
from rtctl.measured import open_dataset, read_dataset
from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.readers import open_table

Write = Callable[..., Path]
FILE = ('"r00.csv"', '"r00.tdms"')
K = np.arange(200.0)


def test_a_channel_goes_by_its_name_unless_several_groups_have_it(tmp_path: Path) -> None:
    path = tmp_path / "r.tdms"
    write_tdms(path, {"a/x": K, "b/x": -K, "b/y": 2 * K})
    assert list(open_table(path).columns) == ["a/x", "b/x", "y"]
    np.testing.assert_array_equal(TableCache().column(path, "b/x", "V"), -K)
    with pytest.raises(ValueError, match='no column "drive"; known: a/x, b/x, y'):
        TableCache().column(path, "drive", "V")


def test_the_unit_of_a_channel_is_held_against_the_manifest(oscillator: Write, tmp_path: Path) -> None:
    write_tdms(tmp_path / "r00.tdms", {"drive": K, "x_tip": K}, {"x_tip": {"unit_string": "um"}})
    with pytest.raises(InputError, match='the file states unit "um" for column "x_tip", the manifest "mm"'):
        open_dataset(oscillator(FILE))
    assert read_dataset(oscillator(FILE, ('unit = "mm"', 'unit = "µm"'))).records[0].samples == 200


@pytest.mark.parametrize(("increment", "agrees"), [(1.0009e-3, True), (1.0011e-3, False), (2e-3, False)])
def test_the_increment_of_a_channel_is_held_against_the_rate(
    oscillator: Write, tmp_path: Path, increment: float, agrees: bool
) -> None:
    write_tdms(tmp_path / "r00.tdms", {"drive": K, "x_tip": K}, {"drive": {"wf_increment": increment}})
    path = oscillator(FILE)
    if agrees:
        assert read_dataset(path).records[0].period_s == 1e-3
        return
    for reader in (read_dataset, open_dataset):
        with pytest.raises(InputError) as caught:
            reader(path)
        assert f'the file states {1 / increment:.6g} Hz for column "drive" (wf_increment = ' in str(
            caught.value
        )
        assert "the manifest sample_rate_hz = 1000 (allowed difference 0.1 %); correct one" in str(
            caught.value
        )


def test_an_increment_that_is_no_time_says_nothing(oscillator: Write, tmp_path: Path) -> None:
    properties = {"drive": {"wf_increment": 0.5, "wf_xunit_string": "Hz"}, "x_tip": {"wf_increment": 0.0}}
    write_tdms(tmp_path / "r00.tdms", {"drive": K, "x_tip": K}, properties)
    assert read_dataset(oscillator(FILE)).records[0].samples == 200


def test_a_scaled_channel_arrives_scaled(tmp_path: Path) -> None:
    scale = {
        "NI_Number_Of_Scales": 1,
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 0.5,
        "NI_Scale[0]_Linear_Y_Intercept": 3.0,
    }
    write_tdms(tmp_path / "r.tdms", {"x": np.arange(200, dtype=np.int16)}, {"x": scale})
    np.testing.assert_array_equal(
        TableCache().column(tmp_path / "r.tdms", "x", "V", 5, 9), 0.5 * K[5:9] + 3.0
    )


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.array(["on", "off"]), 'column "x" holds text, numbers are needed'),
        (
            np.array(["2026-11-21"], dtype="datetime64[us]"),
            r'column "x" holds datetime64\[us\], real numbers',
        ),
        (1j * np.ones(3), 'column "x" holds complex128, real numbers are needed'),
    ],
)
def test_channels_that_are_no_signal(tmp_path: Path, values: np.ndarray, message: str) -> None:
    write_tdms(tmp_path / "r.tdms", {"x": values})
    with pytest.raises(ValueError, match=message):
        TableCache().length(tmp_path / "r.tdms", "x", "V")


def test_an_index_file_of_an_older_measurement_is_not_believed(tmp_path: Path) -> None:
    write_tdms(tmp_path / "old.tdms", {"x": K[:5]})
    write_tdms(tmp_path / "r.tdms", {"x": K})
    index = (tmp_path / "old.tdms").read_bytes().replace(b"TDSm", b"TDSh")
    (tmp_path / "r.tdms_index").write_bytes(index)
    assert TableCache().length(tmp_path / "r.tdms", "x", "V") == 200


@pytest.mark.parametrize("level", ["channel", "group", "file"])
@pytest.mark.parametrize("status", [None, "unscaled", "scaled"])
def test_a_scale_that_the_reader_does_not_know_is_refused(
    tmp_path: Path, level: str, status: str | None
) -> None:
    scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Bridge", "NI_Scale[0]_Bridge_Gain": 2.0}
    scale |= {} if status is None else {"NI_Scaling_Status": status}
    path, at = (
        tmp_path / "r.tdms",
        {name: scale if name == level else {} for name in ("channel", "group", "file")},
    )
    with TdmsWriter(str(path)) as writer:
        channel = ChannelObject("run", "x", np.arange(200, dtype=np.int16), at["channel"])
        writer.write_segment([RootObject(at["file"]), GroupObject("run", at["group"]), channel])
    if status == "scaled":
        np.testing.assert_array_equal(TableCache().column(path, "x", "V"), K)
        return
    with pytest.raises(ValueError, match='"x" is stored as counts with a scale that is not known, "Bridge"'):
        TableCache().length(path, "x", "V")
