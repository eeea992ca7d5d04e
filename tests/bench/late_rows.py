#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Late rows of a configuration, beside other programs: runs the daemon with a client for N frames and prints how many rows
and frames were late, how late rows left, and how many frames were degraded and said why, as a row of a Markdown table.

Usage: late_rows.py OBSCURAD OBSCURA [--config FILE] [--frames N] [--set SECTION.KEY=VALUE]... [--load KIND[:COUNT]]
       [--keep FILE] [--head]
--set   changes a key of the configuration, such as trigger.rate_hz=20 or deadline.quality='"adapt"' (TOML values)
--load  none; hogs: COUNT programs that compute all the time; compiler: COUNT compilers of C++ (default: one for each core)
--keep  keeps the timing file, for `obscura timing FILE --degraded`
--head  prints the head of the table first
A late row was not ready in time, or is stalled: ready in time, it left more than a millisecond late, because the system did not run the
thread that releases it.
Exit status 1 if a row was late, or a degraded frame does not say why.
"""
import argparse
import csv
import math
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
READY_S = 120
SOURCE = "#include <algorithm>\n#include <functional>\n#include <iostream>\n#include <map>\n#include <regex>\n" + "".join(
    f"std::map<std::string, std::function<int(std::regex)>> m{i}; int f{i}(std::string s) {{ return m{i}[s](std::regex(s)); }}\n"
    for i in range(20))
HEAD = ("| configuration | beside | frames | late frames | late rows | of those stalled | first row after its time, p50 | rows, p99.9 | degraded | of those explained "
        "| error, median |\n|---|---|---|---|---|---|---|---|---|---|---|")


def toml(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, list):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {toml(v)}" for k, v in value.items()) + " }"
    return repr(value)


def configuration(file, changes):
    """The text of a configuration with other values; files are those that it names."""
    tables = tomllib.loads(file.read_text(encoding="utf-8"))
    for change in changes:
        place, _, value = change.partition("=")
        *sections, key = place.split(".")
        table = tables
        for section in sections:
            table = table.setdefault(section, {})
        table[key] = tomllib.loads(f"x = {value}")["x"]
    scene = tables.get("scene", {})
    if "file" in scene and (file.parent / scene["file"]).exists():  # else the name of a shipped one
        scene["file"] = str((file.parent / scene["file"]).resolve())
    return "".join(f"{name} = {toml(value)}\n" for name, value in tables.items())


class Load:
    """Other programs at work while it is open."""

    def __init__(self, kind, folder):
        name, _, count = kind.partition(":")
        count = int(count or os.cpu_count())
        self.text = "nothing" if name == "none" else f"{count} {name}" + ("s" if name == "compiler" and count > 1 else "")
        self.commands = []
        if name == "hogs":
            self.commands = [["sh", "-c", "while :; do :; done"]] * count
        elif name == "compiler":
            source = folder / "source.cpp"
            source.write_text(SOURCE, encoding="ascii")
            self.commands = [["sh", "-c", f"while :; do c++ -std=c++20 -O2 -c -o /dev/null {source}; done"]] * count
        elif name != "none":
            sys.exit(f"--load {name}: allowed are none, hogs and compiler")
        self.running = []

    def __enter__(self):
        self.running = [subprocess.Popen(c, start_new_session=True, stderr=subprocess.DEVNULL) for c in self.commands]

    def __exit__(self, *_):
        for process in self.running:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def receive(arguments, address):
    """Receives the frames as a GigE Vision client. Returns what went wrong."""
    grab = subprocess.run([arguments.obscura, "grab", "--address", address, "--frames", str(arguments.frames), "--timeout", "20"],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return "" if grab.returncode == 0 else grab.stdout.strip().splitlines()[-1]


def run(arguments, folder, client=receive):
    """The timing file of a run with a client, and what else went wrong."""
    config, timing, ready = folder / "obscurad.toml", folder / "run.csv", folder / "ready"
    config.write_text(configuration(arguments.config, arguments.set), encoding="utf-8")
    daemon = subprocess.Popen([arguments.obscurad, "--config", config, "--timing", timing, "--ready-file", ready],
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        end = time.monotonic() + READY_S
        while not ready.exists():
            if daemon.poll() is not None or time.monotonic() > end:
                sys.exit("the daemon does not start: " + daemon.communicate()[1])
            time.sleep(0.05)
        complaint = client(arguments, ready.read_text(encoding="ascii").split()[1].rsplit(":", 1)[0])
    finally:
        daemon.send_signal(signal.SIGTERM)
        daemon.communicate()
    return timing, complaint


def quantile(values, q):
    return sorted(values)[max(0, math.ceil(q * len(values)) - 1)] if values else math.nan


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("obscurad")
    parser.add_argument("obscura")
    parser.add_argument("--config", type=pathlib.Path, default=ROOT / "config/realtime.toml")
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--load", default="none")
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--head", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="obscura-late-rows-") as temporary:
        folder = pathlib.Path(temporary)
        load = Load(arguments.load, folder)
        with load:
            timing, complaint = run(arguments, folder)
        text = timing.read_text(encoding="ascii")
        if arguments.keep:
            arguments.keep.write_text(text, encoding="ascii")
    rows = list(csv.DictReader(text.splitlines()))
    if not rows:
        sys.exit("no frame was made; " + complaint)
    late_of = lambda r: int(r["late_rows"]) + int(r["stalled_rows"])
    late_frames = sum(late_of(r) > 0 for r in rows)
    late_rows = sum(map(late_of, rows))
    stalled_rows = sum(int(r["stalled_rows"]) for r in rows)
    first_us = [(int(r["first_ns"]) - int(r["due_ns"])) / 1000 for r in rows if r["first_ns"] != "0"]
    lateness_us = [float(v) for r in rows for v in r["row_lateness_us"].split()] or first_us
    degraded = [r for r in rows if int(r["rows_degraded"]) > 0]
    explained = sum(int(r["quality_reasons"]) != 0 for r in degraded)
    errors = [int(r["error_ppm"]) / 1e4 for r in rows if r["levels"]]
    if arguments.head:
        print(HEAD)
    name = arguments.config.name + "".join(f", `{change}`" for change in arguments.set)
    error = f"{quantile(errors, 0.5):.2f} %" if errors else "-"
    print(f"| {name} | {load.text} | {len(rows)} | {late_frames} | {late_rows} | {stalled_rows} | {quantile(first_us, 0.5):.2f} us | "
          f"{quantile(lateness_us, 0.999):.0f} us | {len(degraded)} | {explained} | {error} |")
    if complaint:
        print("grab: " + complaint, file=sys.stderr)
    return 1 if late_rows or explained < len(degraded) else 0


if __name__ == "__main__":
    sys.exit(main())
