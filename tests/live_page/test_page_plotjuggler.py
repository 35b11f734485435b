"""PlotJuggler gets arrays of records, whose time never goes back, in packets that a network carries."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from page_cases import RecordedLoop

from rtctl.border.errors import InputError
from rtctl.live_page.streams.plotjuggler import LARGEST_PACKET, PlotJugglerSender, packets


@pytest.fixture
def receiver() -> Iterator[socket.socket]:
    """PlotJuggler's end."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
        end.bind(("127.0.0.1", 0))
        end.settimeout(5.0)
        yield end


def received(receiver: socket.socket, records: int) -> list[dict[str, float]]:
    """Return so many records."""
    found: list[dict[str, float]] = []
    while len(found) < records:
        packet = receiver.recv(65536)
        assert len(packet) <= LARGEST_PACKET
        found += json.loads(packet)
    return found


def test_every_new_row_is_a_record_and_time_goes_on_with_the_next_run(
    tmp_path: Path, receiver: socket.socket
) -> None:
    loop = RecordedLoop(tmp_path, begin=40.0)
    loop.append(10)
    sender = PlotJugglerSender(tmp_path, f"127.0.0.1:{receiver.getsockname()[1]}")
    assert sender.look() == 1, "it begins with the newest row"
    loop.append(200)
    assert sender.look() == 200
    records = received(receiver, 201)
    assert [one["setpoint"] for one in records] == [49.0 + k for k in range(201)]
    assert records[7]["timestamp"] == pytest.approx(56e-3), "seconds: 56 periods of 1 ms"
    assert "surrogate" not in records[0], "it is no number here"
    loop.end()
    following = RecordedLoop(tmp_path)
    following.append(3)
    assert sender.look() == 3
    later = received(receiver, 3)
    assert [one["setpoint"] for one in later] == [0.0, 1.0, 2.0]
    times = [one["timestamp"] for one in (*records, *later)]
    assert all(after > before for before, after in zip(times, times[1:], strict=False))
    following.end()
    sender.close()


def test_packets_hold_all_records_in_order() -> None:
    records = [{"timestamp": float(k), "text": "x" * (k % 700)} for k in range(100)]
    sent = list(packets(records))
    assert [one for packet in sent for one in json.loads(packet)] == records
    assert all(len(packet) <= LARGEST_PACKET for packet in sent)
    assert list(packets([])) == []


@pytest.mark.parametrize(
    "address", ["", "9870", "host:", "host:x", "localhost:0", "localhost:70000", "no such.invalid:1"]
)
def test_an_address_that_is_none_is_refused_in_words(tmp_path: Path, address: str) -> None:
    with pytest.raises(InputError, match="--plotjuggler"):
        PlotJugglerSender(tmp_path, address)
