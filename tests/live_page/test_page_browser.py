"""The page in a real browser: each row once over a killed server, drawn while it comes; changes by its fields."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser_cases import chromium, counters, wait_for
from page_cases import RecordedLoop, served

from rtctl.loop.live_parameters import ParameterChannel
from rtctl.session.bench.account import Accounted, bench_account
from rtctl.session.live.control_socket import listening

ROWS_OF_A_STEP = 20
STEP_S = 0.02
"""Together 1 kHz."""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """One browser for all tests of this file: it starts slowly."""
    with chromium(tmp_path_factory.mktemp("profile")) as found:
        yield found


def started(folder: Path, port: int) -> tuple[subprocess.Popen[str], str]:
    """Start a server as a user does; return its process and the page's address."""
    command = [sys.executable, "-m", "rtctl", "watch", str(folder), "--port", str(port), "--quiet"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, process.stdout.readline().strip()


def killed(process: subprocess.Popen[str]) -> None:
    """Kill a server so that it can do nothing about it."""
    process.send_signal(signal.SIGKILL)
    process.communicate()


def test_each_row_arrives_once_over_a_killed_server_and_is_drawn(
    tmp_path: Path, browser: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    folder = tmp_path / "run"
    loop = RecordedLoop(folder, "clock.mode=live")
    loop.append(1000)
    process, address = started(folder, 0)
    try:
        browser.get(address)
        wait_for(lambda: counters(browser)["rows"] == 1000, "the first rows")
        for _ in range(100):
            loop.append(ROWS_OF_A_STEP)
            time.sleep(STEP_S)
        wait_for(lambda: counters(browser)["rows"] == 3000, "the rows of two seconds")
        assert counters(browser)["redraws"] > 10
        killed(process)
        wait_for(lambda: "no connection" in browser.find_element("id", "state").text, "the loss is said")
        loop.append(1500)
        process, again = started(folder, int(address.split(":")[2].split("/")[0]))
        assert again == address, "an open page finds the server under the same address"
        wait_for(lambda: counters(browser)["rows"] == 4500, "the rows that came meanwhile")
        loop.end()
        (folder / "summary.json").write_text(json.dumps(SUMMARY), encoding="utf-8")
        wait_for(lambda: browser.find_element("id", "verdict").text.startswith("pass"), "the verdict")
        browser.find_element("id", "whole").click()
        wait_for(lambda: browser.execute_script(SHOWN) == [0, 4.499], "the whole run is shown")
    finally:
        killed(process)
    found = counters(browser)
    assert (found["lost"], found["doubled"], found["skipped"], found["recordings"]) == (0, 0, 0, 1)
    assert found["sum"] == 4500 * 4501 / 2
    assert found["connections"] == 2
    titles = [one.text for one in browser.find_elements("css selector", "#charts h2")]
    browser.set_script_timeout(10.0)
    axes = [browser.execute_async_script(ALONG_AXIS, list(ticks)) for ticks in TICKS]
    assert axes == [
        ["7.01755", "7.0176", "7.01765"],
        ["1234.25", "1234.5"],
        ["0", "0.5", "1"],
        ["1e-4", "2e-4"],
    ]
    assert titles[:4] == ["Deflection [µm]", "Error [µm]", "Command [mA]", "Reading [Ω]"]
    severe = [line for line in browser.get_log("browser") if line["level"] == "SEVERE"]
    assert [line["message"] for line in severe if "ERR_" not in line["message"]] == []


ALONG_AXIS = (
    "import(`${location.href}js/colours.js`).then((found) => arguments[1](found.alongAxis(arguments[0])))"
)
TICKS = ((7.01755, 7.0176, 7.01765), (1234.25, 1234.5), (0.0, 0.5, 1.0), (1e-4, 2e-4))
SHOWN = "return window.rtctl.page.view.data()?.range.map((one) => Math.round(1e4 * one) / 1e4)"
ERRORS = {"mean_abs_um": 0.25, "max_abs_um": 0.5}
SUMMARY = {
    "verdict": "pass", "tracking": ERRORS, "self_sensing": ERRORS, "checks": [{"check": "x", "met": True}],
    "timing": {"overruns": 0}, "faults": [],
}  # fmt: skip


def test_fields_and_the_stop_button_reach_the_run_also_on_a_tablet(tmp_path: Path, browser: Any) -> None:
    changes = ParameterChannel()
    changes.parameters = lambda: {"controller.kp": 0.0040861, "controller.ki": 8.0}
    with listening(tmp_path, changes), served(tmp_path, control=True) as server:
        loop = RecordedLoop(tmp_path, "clock.mode=live")
        loop.append(300)
        browser.set_window_size(1280, 1000)
        browser.get(server.address)
        wait_for(lambda: browser.find_elements("id", "field-setpoint"), "the fields")
        gain = browser.find_element("id", "field-controller.kp")
        assert gain.get_attribute("value") == "0.0040861"
        assert int(gain.get_property("scrollWidth")) <= int(gain.get_property("clientWidth")), "it is cut off"
        browser.set_window_size(768, 1024)
        browser.get(server.address)
        field = wait_for(lambda: browser.find_elements("id", "field-setpoint"), "the fields")[0]
        field.send_keys("31\n")
        wait_for(lambda: changes, "the set-point")
        assert changes.take() == ("setpoint", 31.0)
        gain = browser.find_element("id", "field-controller.kp")
        gain.clear()
        gain.send_keys("x\n")
        wait_for(
            lambda: "x" in browser.find_element("id", "message").text, "what is no number is refused in words"
        )
        browser.find_element("id", "stop").click()
        wait_for(lambda: changes.stopped, "the stop, without a question")
        width, room = browser.execute_script("return [document.documentElement.scrollWidth, innerWidth]")
        assert width <= room, "nothing sticks out at the side"
        loop.end()


def test_the_axes_follow_what_is_in_view(tmp_path: Path, browser: Any) -> None:
    loop = RecordedLoop(tmp_path, "clock.mode=live")
    with served(tmp_path) as server:
        appended(loop, [0.5 * (k % 200) for k in range(1500)])
        browser.set_window_size(1280, 1000)
        browser.get(server.address)
        wait_for(lambda: counters(browser)["rows"] == 1500, "the rows")
        begin, end = wait_for(lambda: browser.execute_script(LIVE_RANGE), "the first seconds")
        assert (begin, round(end, 6)) == (0, 1.499), "no time before the run's start, in a window of 10 s"
        browser.execute_script("window.rtctl.page.view.show([-2, 3])")
        assert browser.execute_script("return window.rtctl.page.view.range") == [0, 5], "nor by a finger"
        browser.find_element("css selector", "#seconds [value='1']").click()
        appended(loop, [165.0] * 20)
        wait_for(lambda: height(browser) > 160.0, "the disturbance is seen at once")
        deadline = time.monotonic() + 20.0
        while not (found := height(browser)) < 120.0:
            assert time.monotonic() < deadline, f"the axis still spans {found:.0f} um over lines of 100 um"
            appended(loop, [0.5 * (k % 200) for k in range(40)] + [99.5] + [0.0])
            time.sleep(STEP_S)
        loop.end()
    browser.set_script_timeout(10.0)
    assert browser.execute_async_script(FOLLOWED, LOOKS) == [
        [0, 100], [0, 100], [-20, 120], [-20, 120], [-20, 120], [5, 100], [40, 60], [10, 90],
    ]  # fmt: skip


def appended(loop: RecordedLoop, setpoints: list[float]) -> None:
    """Record a row for each set-point [um]."""
    for setpoint in setpoints:
        row = dict.fromkeys([name for name, _ in loop.columns], 0.0)
        row |= {
            "index": float(loop.count),
            "setpoint": setpoint,
            "estimate": setpoint,
            "deflection": setpoint,
        }
        loop.recording.signals.append(tuple(row.values()))
        loop.recording.timings.append((1.0, 20.0, 3.0))
        loop.count += 1


def height(browser: Any) -> float:
    """Return the span of the axis of the first chart [um]."""
    low, high = browser.execute_script("return window.rtctl.page.charts.charts[0].axis.range")
    return float(high) - float(low)


LIVE_RANGE = "return window.rtctl.page.view.data()?.range"
LOOKS = (
    (0, 100, True, 0), (9, 91, True, 1), (-20, 120, True, 2), (10, 100, True, 3), (5, 99, True, 1000),
    (10, 100, True, 1600), (40, 60, True, 1601), (10, 90, False, 1602),
)  # fmt: skip
"""Lowest and highest number in view, whether it moves on, and when [ms]."""
FOLLOWED = (
    "import(`${location.href}js/axis_range.js`).then((found) => { const axis = new found.AxisRange(0);"
    "arguments[1](arguments[0].map((look) => axis.follow(...look))); })"
)


def test_a_served_device_is_shown_also_where_a_reading_is_missing_and_changed_by_its_names(
    tmp_path: Path, browser: Any
) -> None:
    of = Accounted(
        title="what it really does", period_s=1e-3, columns=[("index", ""), ("current", "mA"), ("resistance", "ohm")],
        inputs=["current"], units={"effects.delay": "s", "effects.tcr": "1/K", "fault.stall": "s"},
        judge=lambda name, value: "", values=lambda: {"effects.delay": 0.0, "effects.tcr": 2e-3, "fault.stall": 0.1},
    )  # fmt: skip
    with bench_account(tmp_path, of) as account, served(tmp_path, control=True) as server:
        for k in range(100):
            account.row((float(k), 5.0 + k, math.nan if k < 10 else 1000.0 + k))
        browser.set_window_size(1280, 1000)
        browser.get(server.address)
        effects = wait_for(lambda: browser.find_elements("id", "choose-effects."), "the effects")[0]
        names = [one.text for one in effects.find_elements("tag name", "option")]
        assert names == ["delay", "tcr (0.002 1/K)"]
        for group, name, value in (("effects.", "effects.tcr", "3e-3\n"), ("fault.", "fault.stall", "20")):
            browser.find_element("css selector", f"[id='choose-{group}'] [value='{name}']").click()
            field = browser.find_element("id", f"value-{group}")
            field.clear()
            field.send_keys(value)
        wait_for(lambda: browser.execute_script(TIMES_ASKED) >= 2, "what the device took of the first change")
        assert field.get_attribute("value") == "20", "what is typed meanwhile stays"
        field.send_keys(" ms\n")
        changes: list[tuple[str, float]] = []
        wait_for(lambda: changes.extend(account.changes()) or len(changes) == 2, "the changes")
        assert changes == [("effects.tcr", 3e-3), ("fault.stall", 20e-3)]
        wait_for(lambda: browser.execute_script(TIMES_ASKED) >= 3, "what the device took of the second one")
        low, high = wait_for(lambda: browser.execute_script(SECOND_RANGE), "the chart of the reading")
        assert 900.0 < low < 1010.0
        assert 1099.0 < high < 1200.0


TIMES_ASKED = (
    "return performance.getEntriesByType('resource').filter((one) => one.name.includes('parameters?')).length"
)
SECOND_RANGE = "return window.rtctl.page.charts.charts[1].axis.range"
