"""`rtctl firmware` writes sources that compile, refuses a film that it cannot write, and overwrites nothing unasked."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from firmware_cases import board, host_board, host_program, sources

from drivers.firmware import SOURCES
from plant_sim.catalogue import bundled_plant
from rtctl.border.wire.serial_frames import FrameReader, Request, frame, identity_of
from rtctl.cli import build_parser, main

ROOT = Path(__file__).resolve().parents[2]
SKETCH = Path("examples", "rtctl_vo2", "rtctl_vo2.ino")
STUB = Path(__file__).with_name("arduino")


@pytest.mark.parametrize("converter", ["-DHEATER_PIN=A0", "-UHEATER_PIN"])
def test_the_sketch_is_sound_with_a_converter_of_the_board_and_with_one_on_i2c(
    converter: str, tmp_path: Path
) -> None:
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("there is no g++ here")
    folder = sources(tmp_path / "firmware")
    arduino = ["-x", "c++", "-include", "Arduino.h", f"-I{STUB}", f"-I{folder / 'src'}", "-std=gnu++11"]
    strict = ["-fsyntax-only", "-Wall", "-Wextra", "-Werror"]
    done = subprocess.run(
        [compiler, converter, *arduino, *strict, folder / SKETCH], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_what_is_there_is_overwritten_only_if_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = sources(tmp_path / "firmware")
    (folder / SKETCH).write_text("mine", encoding="utf-8")
    command = ["firmware", "--out", str(folder)]
    assert main(command) == 2
    assert "is not empty" in capsys.readouterr().err
    assert (folder / SKETCH).read_text(encoding="utf-8") == "mine"
    assert main([*command, "--force", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"folder": str(folder), "film": "VO2-A"}
    assert "board_nameplate" in (folder / SKETCH).read_text(encoding="utf-8")


EFFECT = '\n[effects]\ntcr = "0.01 1/K"\n'


@pytest.mark.parametrize(
    ("film", "said"),
    [
        ("vo2_l2p", ["vo2_l2p.toml", 'key "hysteresis.kind"', '"limiting-loop"', "vo2_a"]),
        ("vo2_aa", ["vo2_aa", 'did you mean "vo2_a"']),
        ("me_a", ["me_a.toml", "plant"]),
        ("missing.toml", ["missing.toml: no such plant file"]),
        ("effects", ["effects.toml", 'key "effects"', "rtctl serve --serial"]),
        ("many", ["many.toml", "at most 65535", "65536"]),
    ],
)
def test_a_film_that_the_firmware_has_not_is_one_message(
    film: str, said: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = bundled_plant("vo2_a").read_text(encoding="utf-8")
    written = {"effects": text + EFFECT, "many": text.replace("count = 8192", "count = 65536")}
    if film in written:
        (tmp_path / f"{film}.toml").write_text(written[film], encoding="utf-8")
        film = str(tmp_path / f"{film}.toml")
    assert main(["firmware", film, "--out", str(tmp_path / "firmware")]) == 2
    message = capsys.readouterr().err
    assert all(part in message for part in said), message
    assert not (tmp_path / "firmware").exists()


def test_a_name_with_quotes_and_the_longest_one_are_identities(tmp_path: Path) -> None:
    text = bundled_plant("vo2_a").read_text(encoding="utf-8")
    device = tmp_path / "device.toml"
    device.write_text(text.replace('name = "VO2-A"', "name = '16 \"chars\" \\ ??/'"), encoding="utf-8")
    with board(host_board(host_program(tmp_path / "firmware", device))) as running:
        identity = identity_of(running.ask(Request.IDENTIFY, 1).payload)
    assert identity is not None
    assert identity.name == '16 "chars" \\ ??/'


def test_the_commands_of_the_page_are_commands() -> None:
    page = (ROOT / "docs" / "firmware.md").read_text(encoding="utf-8")
    makefile = (SOURCES / "Makefile").read_text(encoding="utf-8")
    blocks = "\n".join(re.findall(r"```sh\n(.*?)```", page, flags=re.DOTALL)).replace("\\\n", " ")
    commands = [shlex.split(line, comments=True) for line in blocks.splitlines() if line]
    verbs = [words[1] for words in commands if words[0] == "rtctl" and build_parser().parse_args(words[1:])]
    assert verbs == ["firmware", "acquire", "identify", "run", "run", "acquire"]
    targets = [words[3] for words in commands if words[0] == "make"]
    assert targets == ["host", "emulate"]
    assert all(re.search(rf"^{target}:", makefile, flags=re.MULTILINE) for target in targets)


def test_no_bytes_lead_the_device_outside_of_its_memory(tmp_path: Path) -> None:
    checked = "HOST_CC=gcc -g -fsanitize=address,undefined -fno-sanitize-recover"
    program = host_program(tmp_path / "firmware", "vo2_a", checked)
    rng = np.random.default_rng(34)
    noise = bytearray()
    for _ in range(300):
        body = rng.bytes(int(rng.integers(0, 246)))
        sound = frame(
            int(rng.choice([1, 2, 3, 4, 5, 255])),
            int(rng.integers(0, 65536)),
            body[: rng.choice([4, 8, 245])],
        )
        hurt = bytearray(sound)
        hurt[int(rng.integers(0, len(hurt)))] ^= 1 << int(rng.integers(0, 8))
        noise += rng.bytes(int(rng.integers(0, 400))) + sound + hurt + b"\xff" * int(rng.integers(0, 600))
    noise += b"\0" + frame(Request.IDENTIFY, 77)
    done = subprocess.run([program, "-"], input=noise, capture_output=True, timeout=60.0, check=False)
    assert done.returncode == 0, done.stderr.decode()
    assert FrameReader().feed(done.stdout)[-1].tag == 77
