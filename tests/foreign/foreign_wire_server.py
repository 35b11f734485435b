"""A VO2 actuator of another lab behind Modbus TCP (functions 3, 16, 23; one client at a time).

python tests/foreign/foreign_wire_server.py --seed 3 --effect sensor.lag --begin line

Prints "ready HOST:PORT" and what the device is. The effect acts from the start, from a device time [s], or once a line
"begin" comes on standard input (answered by "begun").
"""

from __future__ import annotations

import argparse
import json
import socket
import struct
import sys
import threading
from contextlib import suppress

from foreign_device import EFFECTS
from foreign_wire_benches import wire_bench, wire_effect
from foreign_wire_film import Film
from foreign_wire_registers import Refusal, Registers

READ, WRITE, BOTH = 3, 16, 23
ILLEGAL_FUNCTION, ILLEGAL_VALUE = 1, 3


def answer(registers: Registers, request: bytes) -> bytes:
    """Reply to a request, both from the function code on."""
    function, body = request[0], request[1:]
    try:
        if function == READ:
            return _table(function, registers.read(*struct.unpack(">HH", body)))
        if function == WRITE:
            registers.write(*_to_write(body))
            return request[:5]
        if function == BOTH:
            registers.write(*_to_write(body[4:]))  # the standard: first the writing
            return _table(function, registers.read(*struct.unpack(">HH", body[:4])))
    except Refusal as refusal:
        return bytes((function | 0x80, refusal.code))
    except struct.error:
        return bytes((function | 0x80, ILLEGAL_VALUE))
    return bytes((function | 0x80, ILLEGAL_FUNCTION))


def _table(function: int, words: list[int]) -> bytes:
    return struct.pack(f">BB{len(words)}H", function, 2 * len(words), *words)


def _to_write(body: bytes) -> tuple[int, list[int]]:
    first, count, _ = struct.unpack(">HHB", body[:5])
    return first, list(struct.unpack(f">{count}H", body[5:]))


def serve(listener: socket.socket, registers: Registers) -> None:
    """Answer one client after the other, for ever."""
    while True:
        client, _ = listener.accept()
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with client, client.makefile("rb") as stream, suppress(ConnectionError):
            while len(header := stream.read(7)) == 7:
                transaction, protocol, length, unit = struct.unpack(">HHHB", header)
                reply = answer(registers, stream.read(length - 1))
                client.sendall(struct.pack(">HHHB", transaction, protocol, len(reply) + 1, unit) + reply)


def listen(address: str = "127.0.0.1:0") -> socket.socket:
    """A listening socket at HOST:PORT."""
    host, _, port = address.rpartition(":")
    return socket.create_server((host, int(port)))


def main() -> None:
    """Serve until standard input ends."""
    parser = argparse.ArgumentParser(description="A foreign VO2 actuator behind Modbus TCP.")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--effect", default="none", choices=("none", *EFFECTS))
    parser.add_argument("--begin", default="start", help='"start", a device time in s, or "line"')
    parser.add_argument("--address", default="127.0.0.1:0")
    given = parser.parse_args()
    bench = wire_bench(given.seed)
    effect, share = (None, 0.0) if given.effect == "none" else wire_effect(bench, given.seed, given.effect)
    film = Film(bench.device, effect, begin_s=None if given.begin == "line" else _seconds(given.begin))
    registers = Registers(bench, film, f"foreign {given.seed}", given.seed)
    listener = listen(given.address)
    threading.Thread(target=serve, args=(listener, registers), daemon=True).start()
    host, port = listener.getsockname()
    told = {"style": bench.style, "convention": bench.device.convention, "share": share}
    told |= {"time_constant_s": bench.device.tau_s, "resistance_step_ohm": bench.resistance_step_ohm}
    told |= {"size": effect.size, "unit": effect.unit, "values": effect.values} if effect else {}
    print(f"ready {host}:{port} {json.dumps(told)}", flush=True)
    for line in sys.stdin:
        if line.strip() == "begin":
            film.begin_s = 0.0
            print("begun", flush=True)


def _seconds(begin: str) -> float:
    return 0.0 if begin == "start" else float(begin)


if __name__ == "__main__":
    main()
