"""`rtctl.init` on files as people write them: each is right in every column, unit and rate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet as pq
import pytest
from first_look_cases import motion, write_text
from scipy.io import savemat

import rtctl

M = motion()


def guessed(path: Path, **answers: Any) -> rtctl.Initiation:
    """The manifest of a file in a folder of its own; what `init` writes is read again from the disk."""
    found = rtctl.init(path, out=path.parent / "new", plot=False, **answers)
    again = rtctl.read_dataset(found.path)
    assert [record.samples for record in again.records] == [
        record.samples for record in found.dataset.records
    ]
    return found


def check(
    found: rtctl.Initiation,
    units: dict[str, str],
    rate_hz: float = 1000.0,
    *,
    columns: dict[str, str] | None = None,
) -> None:
    dataset = found.dataset
    assert dataset.units == units
    for record in dataset.records:
        assert 1.0 / record.period_s == pytest.approx(rate_hz, rel=1e-5)
    fit = dataset.records[0].signals
    expected = {"drive": M.u, "displacement": M.x, "velocity": M.v, "acceleration": M.a}
    for name, values in fit.items():
        scale = 0.001 if dataset.units[name] == "m/s^2" else 1.0
        np.testing.assert_allclose(values, scale * expected[name][: len(values)], rtol=1e-5, atol=1e-6)
    for name, column in (columns or {}).items():
        guess = found.proposal.signal(name)
        assert guess is not None
        assert guess.column == column


PLAIN = {"drive": "V", "displacement": "mm"}


@pytest.mark.parametrize(
    ("head", "units"),
    [
        ("time [s],Drive [V],x tip [mm]\n", PLAIN),
        ("t_s,V_drive_V,disp_mm\n", PLAIN),
        ("Time (s),Input (V),Position (mm)\n", PLAIN),
        ("Zeit/s,Kraft/N,Weg/mm\n", {"drive": "N", "displacement": "mm"}),
        ("Zeit in s,Spannung in V,Auslenkung in mm\n", PLAIN),
        ("time,force,disp\ns,N,mm\n", {"drive": "N", "displacement": "mm"}),
        ("time,force,disp\n[s],[N],[mm]\n", {"drive": "N", "displacement": "mm"}),
        ("# bench 3\n# room 23 degC\nt [s],u [V],x [mm]\n", PLAIN),
        ("X_Value [s],exc [V],LVDT [mm]\n", PLAIN),
        ("time [s],ch1 [V],ch2 [mm]\n", PLAIN),
        ("t [sec],volts [Volts],pos [millimeter]\n", PLAIN),
    ],
)
def test_csv_in_many_habits(tmp_path: Path, head: str, units: dict[str, str]) -> None:
    found = guessed(write_text(tmp_path / "r.csv", head, M.t, M.u, M.x))
    check(found, dict(units))


def test_a_german_table_with_commas_and_semicolons(tmp_path: Path) -> None:
    path = write_text(
        tmp_path / "r.csv", "Zeit;Kraft;Weg\ns;N;mm\n", M.t, M.u, M.x, separator=";", comma=True
    )
    check(guessed(path), {"drive": "N", "displacement": "mm"})


def test_a_german_table_in_latin_1_with_ms_and_micrometres(tmp_path: Path) -> None:
    path = write_text(
        tmp_path / "r.txt", "Zeit [ms]\tErregung [V]\tAuslenkung [µm]\n", 1e3 * M.t, M.u, M.x,
        separator="\t", comma=True, encoding="latin-1",
    )  # fmt: skip
    found = guessed(path)
    assert found.dataset.units["displacement"] in ("µm", "um")
    assert found.dataset.records[0].period_s == pytest.approx(1e-3)


@pytest.mark.parametrize(
    ("head", "factor"),
    [("t_ms,u [V],x [mm]\n", 1e3), ("time (µs),u [V],x [mm]\n", 1e6), ("Zeit/ms,u [V],x [mm]\n", 1e3)],
)
def test_times_in_other_units(tmp_path: Path, head: str, factor: float) -> None:
    found = guessed(write_text(tmp_path / "r.csv", head, factor * M.t, M.u, M.x))
    check(found, PLAIN)


@pytest.mark.parametrize(("origin", "factor", "unit"), [(1.7e9, 1.0, "s"), (1.7e12, 1e3, "ms")])
def test_times_since_1970(tmp_path: Path, origin: float, factor: float, unit: str) -> None:
    stamps = [f"{origin + factor * t:.4f}" for t in M.t]
    found = guessed(write_text(tmp_path / "r.csv", "timestamp,u [V],x [mm]\n", stamps, M.u, M.x))
    check(found, PLAIN)
    assert found.proposal.time.unit == unit
    assert any("since 1970" in text for text in found.unsure)


def test_dates(tmp_path: Path) -> None:
    start = np.datetime64("2026-11-21T10:00:00", "ms")
    stamps = [str(start + np.timedelta64(k, "ms")) for k in range(len(M.t))]
    found = guessed(write_text(tmp_path / "r.csv", "when,u [V],x [mm]\n", stamps, M.u, M.x))
    check(found, PLAIN)
    assert found.proposal.time.column == "when"


def test_no_header_with_what_the_user_says(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.dat", "", M.t, M.u, M.x, separator="  ")
    check(guessed(path, inputs="column_2:V", outputs="displacement=column_3:mm"), PLAIN)


def test_an_accelerometer_in_g_and_a_force(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "time [s],force [N],acc (g)\n", M.t, M.u, M.a / 9806.65)
    found = guessed(path)
    check(found, {"drive": "N", "acceleration": "m/s^2"})
    assert 'unit = "g_0"' in found.path.read_text()
    assert any("standard gravity" in text for text in found.unsure)


def test_a_base_acceleration_drives_a_tip_acceleration(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],tip acc [mm/s^2],base acc [mm/s^2]\n", M.t, M.a, M.u)
    check(guessed(path), {"drive": "mm/s^2", "acceleration": "mm/s^2"})


def test_displacement_and_velocity_together(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],u [V],x [mm],v [mm/s]\n", M.t, M.u, M.x, M.v)
    check(guessed(path), {**PLAIN, "velocity": "mm/s"})


def test_what_leads_is_the_drive_where_neither_name_nor_unit_tells(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],A1 [V],A2 [V]\n", M.t, M.x, M.u)
    found = guessed(path, outputs="displacement=A1")
    check(found, {"drive": "V", "displacement": "V"}, columns={"drive": "A2 [V]"})
    path = write_text(tmp_path / "s.csv", "t [s],acc1 [mm/s^2],acc2 [mm/s^2]\n", M.t, M.a, M.u)
    found = rtctl.init(path, out=tmp_path / "s", plot=False)
    check(found, {"drive": "mm/s^2", "acceleration": "mm/s^2"}, columns={"drive": "acc2 [mm/s^2]"})
    assert any("leads in the data" in text for text in found.unsure)


def test_a_vo2_actuator_and_its_staircase(tmp_path: Path) -> None:
    current = np.repeat(np.concatenate([np.linspace(4.0, 8.0, 40), np.linspace(8.0, 4.0, 40)]), 10)
    resistance, deflection = 1e5 / current, 10.0 * current
    t = 0.01 * np.arange(len(current))
    path = write_text(tmp_path / "r.csv", "t [s],I_mA,R_ohm,defl_um\n", t, current, resistance, deflection)
    found = guessed(path)
    assert found.dataset.plant == "vo2"
    assert found.dataset.units == {"current": "mA", "resistance": "ohm", "deflection": "um"}
    assert found.dataset.holds == {"current": "zero"}
    assert [record.use for record in found.dataset.records] == ["identify"]


def test_parquet_with_units_in_its_schema(tmp_path: Path) -> None:
    fields = [
        pa.field("t", pa.float64(), metadata={"unit": "s"}),
        pa.field("u", pa.float64(), metadata={"unit": "V"}),
        pa.field("x", pa.float64(), metadata={"units": "mm"}),
    ]
    pq.write_table(pa.table([M.t, M.u, M.x], schema=pa.schema(fields)), tmp_path / "r.parquet")
    check(guessed(tmp_path / "r.parquet"), PLAIN)


def test_arrow_with_units_in_names(tmp_path: Path) -> None:
    table = pa.table({"t_s": M.t, "drive [V]": M.u, "x [mm]": M.x})
    pa.feather.write_feather(table, tmp_path / "r.feather")
    check(guessed(tmp_path / "r.feather"), PLAIN)


def test_npz_with_a_rate(tmp_path: Path) -> None:
    np.savez(tmp_path / "r.npz", fs=1000.0, **{"u [V]": M.u, "x [mm]": M.x})
    found = guessed(tmp_path / "r.npz")
    check(found, PLAIN)
    assert any('"fs"' in text for text in found.unsure)


def test_mat_with_plain_arrays(tmp_path: Path) -> None:
    savemat(tmp_path / "r.mat", {"dt": 1e-3, "u": M.u, "x": M.x[:, None]})
    check(guessed(tmp_path / "r.mat", inputs="u:V", outputs={"displacement": "x:mm"}), PLAIN)


def test_mat_with_a_struct(tmp_path: Path) -> None:
    savemat(tmp_path / "r.mat", {"run": {"time": M.t, "force_N": M.u, "disp_mm": M.x, "fs": 1000.0}})
    found = guessed(tmp_path / "r.mat", time="run.time:s")
    check(found, {"drive": "N", "displacement": "mm"}, columns={"drive": "run.force_N"})


@pytest.mark.parametrize("suffix", [".h5", ".hdf5"])
def test_hdf5_with_attributes(tmp_path: Path, suffix: str) -> None:
    with h5py.File(tmp_path / f"r{suffix}", "w") as file:
        for name, values, unit in (("time", M.t, "s"), ("force", M.u, "N"), ("pos", M.x, "mm")):
            file.create_dataset(f"run1/{name}", data=values).attrs["units"] = unit
    found = guessed(tmp_path / f"r{suffix}")
    check(found, {"drive": "N", "displacement": "mm"}, columns={"drive": "run1/force"})


def test_uff_with_a_rate_of_its_own(tmp_path: Path) -> None:
    from measured_files import uff58, write_uff

    functions = [
        uff58(M.u, id1="force", unit="N", increment=1e-3),
        uff58(M.a, id1="x tip", unit="mm/s2", increment=1e-3),
    ]
    write_uff(tmp_path / "r.uff", functions)
    found = guessed(tmp_path / "r.uff")
    check(found, {"drive": "N", "acceleration": "mm/s^2"})
    assert "sample_rate_hz" not in "".join(
        line for line in found.path.read_text().splitlines() if line[:1] != "#"
    )


def test_a_tdms_waveform(tmp_path: Path) -> None:
    from measured_files import write_tdms

    waveform = {"wf_increment": 1e-3, "wf_start_offset": 0.0, "wf_samples": 1}
    write_tdms(
        tmp_path / "r.tdms",
        {"Drive": M.u, "Displacement": M.x},
        {"Drive": {**waveform, "unit_string": "V"}, "Displacement": {**waveform, "unit_string": "mm"}},
    )
    check(guessed(tmp_path / "r.tdms"), PLAIN)


def test_the_last_third_is_the_test_and_only_its_last_third_is_scored(tmp_path: Path) -> None:
    found = guessed(write_text(tmp_path / "r.csv", "t [s],u [V],x [mm]\n", M.t, M.u, M.x))
    fit, test = found.dataset.records
    assert (fit.use, fit.samples, test.use) == ("fit", 2000, "test")
    np.testing.assert_allclose(
        test.signals["displacement"][test.ignore_first :], M.x[2000:], rtol=1e-5, atol=1e-7
    )


def test_several_files_keep_every_third_or_the_one_that_says_so(tmp_path: Path) -> None:
    def write(name: str) -> Path:
        return write_text(tmp_path / name, "t [s],u [V],x [mm]\n", M.t, M.u, M.x)

    def uses(*names: str, **answers: Any) -> list[str]:
        found = rtctl.init(
            [write(name) for name in names], out=tmp_path / "new", force=True, plot=False, **answers
        )
        return [record.use for record in found.dataset.records]

    assert uses("a.csv", "b.csv") == ["fit", "test"]
    assert uses("a.csv", "b.csv", "c.csv", "d.csv") == ["fit", "fit", "test", "fit"]
    assert uses("a.csv", "run_test.csv", "z.csv") == ["fit", "test", "fit"]
    assert uses("a.csv", "b.csv", test="a.csv") == ["test", "fit"]
    assert uses("a.csv", "b.csv", test="none") == ["fit", "fit"]
    assert uses("a.csv", test="none") == ["fit"]


def test_a_gap_divides_a_file_and_uneven_steps_are_resampled(tmp_path: Path) -> None:
    t = M.t + np.where(np.arange(len(M.t)) >= 1000, 2.0, 0.0)
    found = guessed(write_text(tmp_path / "r.csv", "t [s],u [V],x [mm]\n", t, M.u, M.x))
    assert [record.samples for record in found.dataset.records] == [1000, 2000]
    assert any(
        "a gap in time, where about 2000 rows are missing (the first after row 999): 2 parts" in text
        for text in found.unsure
    )
    uneven = M.t + np.where(np.arange(len(M.t)) % 2, 2e-4, 0.0)
    found = rtctl.init(
        write_text(tmp_path / "s.csv", "t [s],u [V],x [mm]\n", uneven, M.u, M.x), out=tmp_path / "s"
    )
    assert "resample = true" in found.path.read_text()
    assert any("it is resampled" in text for text in found.unsure)


def test_stamps_of_seven_digits_have_the_rate_of_the_line_through_them(tmp_path: Path) -> None:
    """At 2048 Hz a seventh digit is 0.2 % of a step: the readers would ask for resampling, at 2049.18 Hz."""
    fine = motion(12_000, 2048.0)
    found = guessed(
        write_text(tmp_path / "r.csv", "t [s];u [V];x [mm]\n", fine.t, fine.u, fine.x, separator=";")
    )
    for record in found.dataset.records:
        assert 1.0 / record.period_s == 2048.0
    assert "resample" not in found.path.read_text()
    np.testing.assert_allclose(found.dataset.records[0].signals["drive"], fine.u[:8000], rtol=1e-5, atol=1e-6)


def test_a_rate_beside_a_time_tells_its_unit(tmp_path: Path) -> None:
    for k, (factor, unit) in enumerate(((1.0, "s"), (1e3, "ms"))):
        path = tmp_path / f"r{k}.npz"
        np.savez(path, fs=1000.0, t=factor * M.t, **{"u [V]": M.u, "x [mm]": M.x})
        found = guessed(path, force=True)
        check(found, PLAIN)
        assert found.proposal.time.unit == unit
    np.savez(tmp_path / "r.npz", fs=500.0, t=M.t, **{"u [V]": M.u, "x [mm]": M.x})
    with pytest.raises(rtctl.InputError, match='variable "fs" of the file gives 500 Hz'):
        guessed(tmp_path / "r.npz", force=True)


def test_each_file_has_the_rate_that_its_own_line_states(tmp_path: Path) -> None:
    for name, line in (
        ("a", "# fs = 1000 Hz"),
        ("b", "# fs = 500 Hz"),
        ("c", "# fs = 2,000 Hz"),
        ("d", "# none"),
    ):
        write_text(tmp_path / f"{name}.csv", f"{line}\nu [V],x [mm]\n", M.u, M.x)
    found = rtctl.init([tmp_path / "a.csv", tmp_path / "b.csv"], plot=False)
    assert [1.0 / one.period_s for one in found.dataset.records] == [1000.0, 500.0]
    assert found.path.read_text().count("sample_rate_hz") == 2
    for other, words in (("c", 'in c.csv line 1 "# fs = 2,000 Hz"'), ("d", "d.csv states no rate")):
        with pytest.raises(rtctl.InputError, match=words) as caught:
            rtctl.init([tmp_path / "a.csv", tmp_path / f"{other}.csv"], plot=False, force=True)
        assert 'line 1 "# fs = 1000 Hz" of a.csv gives 1000 Hz' in str(caught.value)


def test_rows_without_numbers_are_left_out(tmp_path: Path) -> None:
    x = M.x.copy()
    x[:20] = np.nan
    found = guessed(write_text(tmp_path / "r.csv", "t [s],u [V],x [mm]\n", M.t, M.u, x), test="none")
    (record,) = found.dataset.records
    assert record.samples == 2980
    assert any("rows without numbers" in text for text in found.unsure)


def test_columns_that_are_no_signals_are_left_out_with_the_reason(tmp_path: Path) -> None:
    n = np.arange(len(M.t), dtype=float)
    path = write_text(
        tmp_path / "r.csv",
        "n,t [s],u [V],x [mm],temp [degC],flag\n",
        n,
        M.t,
        M.u,
        M.x,
        20.0 + 0.1 * n,
        0.0 * n,
    )
    found = guessed(path)
    check(found, PLAIN)
    assert found.proposal.unused.keys() == {"n", "temp [degC]", "flag"}
    assert "constant" in found.proposal.unused["flag"]


def test_a_drive_in_steps_is_held(tmp_path: Path) -> None:
    u = np.repeat(M.u[::10], 10)
    found = guessed(write_text(tmp_path / "r.csv", "t [s],u [V],x [mm]\n", M.t, u, M.x))
    assert found.dataset.holds == {"drive": "zero"}
    assert found.unsure == ()


def test_a_hold_that_no_row_shows_is_told_until_it_is_said(tmp_path: Path) -> None:
    rough = np.random.default_rng(5).standard_normal(len(M.t))
    path = write_text(tmp_path / "r.csv", "t [s],u [V],x [mm]\n", M.t, rough, M.x)
    found = guessed(path)
    assert found.dataset.holds == {"drive": "linear"}
    (told,) = found.unsure
    for words in ("do not show how it goes on", 'hold = "linear"', "--hold zero", "half a sample of delay"):
        assert words in told
    assert rtctl.init(path, out=tmp_path / "said", plot=False, hold="zero").unsure == ()


def test_a_smooth_drive_is_the_curve_through_its_rows(tmp_path: Path) -> None:
    noisy = M.u + 0.01 * np.std(M.u) * np.random.default_rng(5).standard_normal(len(M.u))
    found = guessed(write_text(tmp_path / "smooth.csv", "t [s],u [V],x [mm]\n", M.t, noisy, M.x))
    assert found.dataset.holds == {"drive": "band-limited"}
    (told,) = found.unsure
    for words in ("nothing of it near half the sample rate", "--hold zero", "half a sample of delay"):
        assert words in told


def test_a_smooth_drive_with_a_step_goes_on_in_straight_lines(tmp_path: Path) -> None:
    stepped = M.u + np.where(M.t < 0.5 * M.t[-1], 0.0, np.std(M.u))
    found = guessed(write_text(tmp_path / "step.csv", "t [s],u [V],x [mm]\n", M.t, stepped, M.x))
    assert found.dataset.holds == {"drive": "linear"}


@pytest.mark.parametrize(
    ("unit", "told"), [("mm", 'its name has "um" at its end'), ("um", ""), ("micron", "")]
)
def test_a_unit_that_the_name_of_the_column_contradicts_is_told(tmp_path: Path, unit: str, told: str) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],u [V],x_um\n", M.t, M.u, M.x)
    found = guessed(path, outputs={"displacement": f"x_um:{unit}"}, hold="zero")
    expected = (f'displacement: column "x_um" is read in {unit}, as you said, but {told}',) if told else ()
    assert found.unsure == expected


@pytest.mark.parametrize(
    ("name", "rate", "said", "told"),
    [
        ("t", {}, "t:ms", "in seconds it gives 1000 Hz"),
        ("t", {}, "t:s", ""),
        ("t_ms", {}, "t_ms:s", 'its name has "ms" at its end'),
        ("t", {"fs": 1000.0}, "t:ms", 'the variable "fs" of the file gives 1000 Hz'),
        ("t", {"fs": 1000.0}, "t:s", ""),
    ],
)
def test_a_unit_of_time_that_the_rest_contradicts_is_told(
    tmp_path: Path, name: str, rate: dict[str, float], said: str, told: str
) -> None:
    path = tmp_path / "r.npz"
    np.savez(path, **{name: M.t, "u [V]": M.u, "x [mm]": M.x, **rate})  # type: ignore[arg-type]
    found = guessed(path, time=said, hold="zero")
    assert len(found.unsure) == bool(told)
    assert all(told in one and "as you said" in one for one in found.unsure)


def test_a_manifest_elsewhere_refers_to_the_files_where_they_are(tmp_path: Path) -> None:
    (tmp_path / "raw").mkdir()
    path = write_text(tmp_path / "raw" / "r.csv", "t [s],u [V],x [mm]\n", M.t, M.u, M.x)
    before = path.read_bytes()
    found = rtctl.init(path, out=tmp_path / "studies" / "one")
    assert 'file = "../../raw/r.csv"' in found.path.read_text()
    assert path.read_bytes() == before
    assert {one.name for one in found.path.parent.iterdir()} == {"dataset.toml", "preview.png"}
