"""The host in C flies by the clock, takes commands and sends telemetry by UDP, and goes on after it has been killed.

Run by CTest: python3 -m pytest executive_test.py, with TRIHEDRON_BUILD naming the build directory.
"""
import contextlib
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess

import pytest

EXECUTIVE = pathlib.Path(os.environ["TRIHEDRON_BUILD"]) / "executive"
HEADER = (pathlib.Path(__file__).resolve().parents[2] / "core" / "include" / "trihedron_tables.h").read_text()
TIMEOUT_S = 60
FORMATS = {"int64_t": "q", "double": "d", "uint32_t": "I", "uint8_t": "B"}


def constant(name):
    return int(re.search(rf"\b{name}\b(?: =)? (\d+)", HEADER).group(1))


def housekeeping(datagram):
    """The record as the C header lays it out."""
    body = re.search(r"typedef struct trihedron_housekeeping \{(.*?)\} trihedron_housekeeping;", HEADER, re.DOTALL).group(1)
    fields = re.findall(r"^  (\w+) (\w+)(?:\[(\d+)\])?;", body, re.MULTILINE)
    record, offset = {}, 0
    for kind, name, count in fields:
        form = f"={count or 1}{FORMATS[kind]}"
        values = struct.unpack_from(form, datagram, offset)
        record[name] = values if count else values[0]
        offset += struct.calcsize(form)
    assert offset == len(datagram) == constant("TRIHEDRON_HOUSEKEEPING_SIZE")
    return record


class Ground:
    """Receives telemetry and sends commands."""

    def __init__(self):
        self.telemetry = self.bound()
        self.commands = self.bound()
        with self.bound() as free:
            self.command_port = free.getsockname()[1]
        self.processes = []

    @staticmethod
    def bound():
        its = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        its.bind(("127.0.0.1", 0))
        its.settimeout(TIMEOUT_S)
        return its

    def start(self, *arguments):
        process = subprocess.Popen([EXECUTIVE, "--speed", "100", "--telemetry", str(self.telemetry.getsockname()[1]), "--command",
                                    str(self.command_port), *arguments], stdout=subprocess.PIPE, text=True)
        self.processes.append(process)
        return process

    def record(self):
        return housekeeping(self.telemetry.recv(4096))

    def record_when(self, condition):
        while True:
            record = self.record()
            if condition(record):
                return record

    def forget(self):
        """Drops records of a process that has ended: the next one is of a process that listens for commands."""
        self.telemetry.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                self.record()
        self.telemetry.settimeout(TIMEOUT_S)

    def command(self, command, argument=0):
        self.commands.sendto(struct.pack("=2I", command, argument), ("127.0.0.1", self.command_port))
        return struct.unpack("=I", self.commands.recv(4))[0]

    def end(self, process):
        cycles = self.command(0xFFFFFFFF)
        output, _ = process.communicate(timeout=TIMEOUT_S)
        assert process.returncode == 0
        return cycles, output


@pytest.fixture
def ground():
    its = Ground()
    yield its
    for process in its.processes:  # where a test has failed, it still flies
        process.kill()
        process.wait()
        process.stdout.close()
    its.telemetry.close()
    its.commands.close()


def test_commands_are_answered_and_telemetry_tells(ground):
    process = ground.start()
    assert ground.record()["mode"] == constant("TRIHEDRON_MODE_STANDBY")
    assert ground.command(constant("TRIHEDRON_COMMAND_CORRECT_NOW")) == constant("TRIHEDRON_ANSWER_NOT_IN_THIS_MODE")
    assert ground.command(77) == constant("TRIHEDRON_ANSWER_UNKNOWN_COMMAND")
    assert ground.command(constant("TRIHEDRON_COMMAND_START")) == constant("TRIHEDRON_ANSWER_ACCEPTED")
    record = ground.record_when(lambda its: its["mode"] == constant("TRIHEDRON_MODE_CALIBRATING"))
    assert record["attitude_valid"] == 1 and record["fixes_used"] >= 20 and record["commands_refused"] == 2
    assert ground.command(constant("TRIHEDRON_COMMAND_RESET")) == constant("TRIHEDRON_ANSWER_ACCEPTED")
    ground.record_when(lambda its: its["mode"] == constant("TRIHEDRON_MODE_STANDBY"))
    cycles, output = ground.end(process)
    assert cycles > 480
    assert re.search(rf"{cycles} cycles, \d+ deadlines missed", output)


def test_killed_it_goes_on_from_its_snapshots(ground, tmp_path):
    snapshots = ("--snapshots", str(tmp_path / "snapshots"))
    process = ground.start(*snapshots)
    ground.record()
    ground.command(constant("TRIHEDRON_COMMAND_START"))
    before = ground.record_when(lambda its: its["fixes_used"] >= 30)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    ground.forget()
    process = ground.start(*snapshots)
    after = ground.record_when(lambda its: its["fixes_used"] >= 40)
    _, output = ground.end(process)
    assert "goes on from snapshot" in output
    assert after["samples_used"] > before["samples_used"] and after["gaps"] == 0 and after["samples_rejected"] == 0


@pytest.mark.parametrize("arguments", [["--speed", "0"], ["--speed", "fast"], ["--port"], ["--command", "70000"], ["--duration"]])
def test_wrong_options_are_refused(arguments):
    assert subprocess.run([EXECUTIVE, *arguments], capture_output=True, timeout=TIMEOUT_S).returncode == 2
