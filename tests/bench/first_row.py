#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""From the trigger to the first row: source x scene x other programs, as a Markdown table.

Usage: first_row.py OBSCURAD OBSCURA [--source NAME]... [--scene NAME]... [--load KIND[:COUNT]]... [--frames N (50)]
       first_row.py --of TIMING --source NAME --scene NAME [--load TEXT]
--source  timer: the configuration's own; udp: datagrams; software: TriggerSoftware of a GigE Vision client; action: ACTION
          commands; step: steps of a simulator, after one another (default all)
--scene   demo: config/demo.toml; asteroid: config/realtime.toml; moon: config/moon-realtime.toml (default demo and asteroid)
--load    as late_rows.py (default none)
--of      a row of a timing file that is there; the kernel rig makes those of gpio, pps and ptp_timer (tests/kernel/run first_row)
A row is due as the chip reads it, exposure and readout after its edge. Exit status 1 if a row was late.
"""
import argparse
import csv
import os
import pathlib
import select
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
import types

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1] / "support")]
import late_rows  # noqa: E402
import simulator_client  # noqa: E402

SCENES = {"demo": "demo", "asteroid": "realtime", "moon": "moon-realtime"}
HEAD = ("| source | scene | beside | frames | first row due after its edge | leaves after its edge, p50 | p99.9 | late frames | late rows |\n"
        "|---|---|---|---|---|---|---|---|---|")


def row(source, scene, beside, text):
    frames = list(csv.DictReader(text.splitlines()))
    edge_to = lambda column: [(int(f[column]) - int(f["edge_ns"])) / 1e6 for f in frames if f["first_ns"] != "0"]
    left = edge_to("first_ns")
    late = [int(f["late_rows"]) + int(f["stalled_rows"]) for f in frames]
    print(f"| {source} | {scene} | {beside} | {len(frames)} | {late_rows.quantile(edge_to('due_ns'), 0.5):.3f} ms | "
          f"{late_rows.quantile(left, 0.5):.3f} ms | {late_rows.quantile(left, 0.999):.3f} ms | {sum(n > 0 for n in late)} | {sum(late)} |", flush=True)
    return sum(late)


class Gvcp:
    """As much of a GigE Vision client as triggers by ACTION commands need; the stream is not read."""
    CONTROL, STREAM_PORT, STREAM_TO, GROUP_MASK = 0x0A00, 0x0D00, 0x0D18, 0x9804
    START, STOP, TRIGGER_SOURCE, ACTION1 = 0xA104, 0xA108, 0xAA04, 2  # docs/reference/features.md, core/camera/trigger.hpp

    def __init__(self, address):
        self.to, self.number = (address, 3956), 0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.stream = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.stream.bind(("", 0))

    def command(self, kind, payload):
        self.number = self.number % 0xFFFF + 1
        for _ in range(5):
            self.socket.sendto(struct.pack(">BBHHH", 0x42, 1, kind, len(payload), self.number) + payload, self.to)
            if select.select([self.socket], [], [], 0.5)[0]:
                answer = self.socket.recv(600)
                if struct.unpack(">H", answer[:2])[0]:
                    raise OSError(f"command {kind:#x} is answered with status {answer[:2].hex()}")
                return answer
        raise OSError("the camera does not answer")

    def write(self, register, value):
        self.command(0x0082, struct.pack(">II", register, value))

    def fire(self, count, rate_hz):
        try:  # of this thread: what triggers does not wait for other programs
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(60))
        except PermissionError:
            pass
        try:
            return self.fire_in_time(count, rate_hz)
        finally:
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))

    def fire_in_time(self, count, rate_hz):
        self.write(self.CONTROL, 2)
        self.write(self.STREAM_PORT, self.stream.getsockname()[1])
        self.write(self.STREAM_TO, struct.unpack(">I", socket.inet_aton(self.to[0]))[0])
        self.write(self.GROUP_MASK, 1)
        self.write(self.TRIGGER_SOURCE, self.ACTION1)
        self.write(self.START, 1)
        begin = time.monotonic() + 1
        for k in range(count):
            time.sleep(max(0.0, begin + k / rate_hz - time.monotonic()))
            self.command(0x0100, struct.pack(">III", 0, 0, 1))
        time.sleep(1)
        self.write(self.STOP, 1)
        self.write(self.CONTROL, 0)
        return ""


def by_software(rate_hz):
    def client(arguments, address):
        grab = subprocess.run([arguments.obscura, "grab", "--address", address, "--frames", str(arguments.frames), "--timeout", "20",
                               "--software-trigger-rate", str(rate_hz)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        return "" if grab.returncode == 0 else grab.stdout.strip().splitlines()[-1]
    return client


def beside_grab(start):
    """A client that receives while `start(arguments)` makes a program that triggers."""
    def client(arguments, address):
        trigger = start(arguments)
        try:
            return late_rows.receive(arguments, address)
        finally:
            trigger.kill()
            trigger.wait()
    return client


def datagrams(rate_hz):
    return beside_grab(lambda arguments: subprocess.Popen([arguments.obscura, "trigger", "--rate", str(rate_hz), "--frames", "0"],
                                                          stdout=subprocess.DEVNULL))


def steps(rate_hz):
    """Steps follow one another, each when the frame before has left, while a client receives."""
    def client(arguments, address):
        ended = threading.Event()

        def step():
            with simulator_client.Simulator("127.0.0.1", 5003) as simulator:
                k = 0
                while not ended.is_set():
                    try:
                        simulator.step(k / rate_hz)
                        k += 1
                    except simulator_client.Refused:  # the client has not begun, or has what it wants
                        time.sleep(0.02)
        thread = threading.Thread(target=step)
        thread.start()
        try:
            return late_rows.receive(arguments, address)
        finally:
            ended.set()
            thread.join()
    return client


def source_of(name, rate_hz):
    """Changes of the configuration, and the client."""
    return {"timer": ([], late_rows.receive),
            "udp": (['trigger.source="udp"'], datagrams(rate_hz)),
            "software": ([], by_software(rate_hz)),
            "action": ([], lambda arguments, address: Gvcp(address).fire(arguments.frames, rate_hz)),
            "step": (['trigger.source="lockstep"', "simulator.enabled=true"], steps(rate_hz))}[name]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("programs", nargs="*")
    parser.add_argument("--source", action="append", default=[])
    parser.add_argument("--scene", action="append", default=[])
    parser.add_argument("--load", action="append", default=[])
    parser.add_argument("--frames", type=int, default=50)
    parser.add_argument("--of", type=pathlib.Path)
    arguments = parser.parse_args()
    if arguments.of:
        return 1 if row(arguments.source[0], arguments.scene[0], " ".join(arguments.load) or "nothing",
                        arguments.of.read_text(encoding="ascii")) else 0
    if len(arguments.programs) != 2:
        parser.error("OBSCURAD and OBSCURA are needed")
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before\n\n{HEAD}", flush=True)
    late = 0
    for kind in arguments.load or ["none"]:
        for scene in arguments.scene or ["demo", "asteroid"]:
            config = late_rows.ROOT / f"config/{SCENES[scene]}.toml"
            rate_hz = tomllib.loads(config.read_text(encoding="utf-8"))["trigger"]["rate_hz"]
            for name in arguments.source or ["timer", "udp", "software", "action", "step"]:
                changes, client = source_of(name, rate_hz)
                asked = types.SimpleNamespace(obscurad=arguments.programs[0], obscura=arguments.programs[1], config=config,
                                              set=changes, frames=arguments.frames)
                with tempfile.TemporaryDirectory(prefix="obscura-first-row-") as temporary:
                    load = late_rows.Load(kind, pathlib.Path(temporary))
                    with load:
                        timing, complaint = late_rows.run(asked, pathlib.Path(temporary), client)
                    late += row(name, scene, load.text, timing.read_text(encoding="ascii"))
                if complaint:
                    print(f"{name}, {scene}: {complaint}", file=sys.stderr)
    return 1 if late else 0


if __name__ == "__main__":
    sys.exit(main())
