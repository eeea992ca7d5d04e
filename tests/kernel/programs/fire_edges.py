#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Raises and lowers a simulated GPIO line, one pulse after another, each as soon as the daemon has written the frame of the
one before: fire_edges.py FILE FRAMES-FOLDER FIRST COUNT [ON [OFF]]

COUNT is a number, or while=PID: as long as that process lives. ON (default pull-up) is written to FILE for the edge, OFF
(pull-down, with another ON nothing) after its frame.

Fails when an edge gives no frame, more than one, or a frame with another time stamp than the edge's.
"""
import itertools
import pathlib
import re
import sys
import time

pull = pathlib.Path(sys.argv[1])
folder = pathlib.Path(sys.argv[2])
first = int(sys.argv[3])
customer = int(sys.argv[4].removeprefix("while=")) if sys.argv[4].startswith("while=") else None
on = sys.argv[5] if len(sys.argv) > 5 else "pull-up"
off = sys.argv[6] if len(sys.argv) > 6 else "pull-down" if on == "pull-up" else None
slack_ns = 50_000_000  # the simulated interrupt may come a little after the write has returned


def wanted(number):
    if customer is None:
        return number < first + int(sys.argv[4])
    try:
        return ") Z " not in pathlib.Path(f"/proc/{customer}/stat").read_text()
    except OSError:
        return False


fired = 0
for number in itertools.takewhile(wanted, itertools.count(first)):
    before = time.monotonic_ns()
    pull.write_text(on)
    after = time.monotonic_ns()
    told = folder / f"frame_{number:06}.toml"
    while True:
        text = told.read_text() if told.exists() else ""
        edge = re.search(r"^T_EDGE *= *(\d+)\b.*\n", text, re.M)
        if edge:
            break
        if time.monotonic_ns() - before > 20e9:
            sys.exit(f"edge {number} gave no frame")
        time.sleep(0.002)
    if off:
        pull.write_text(off)
    if not before <= int(edge[1]) <= after + slack_ns:
        sys.exit(f"frame {number} says its edge was at {edge[1]} ns, it was between {before} and {after}")
    if (folder / f"frame_{number + 1:06}.toml").exists():
        sys.exit(f"edge {number} gave two frames")
    fired += 1
    if customer is not None:
        time.sleep(0.05)  # it has to start up, which takes longest of all
print(f"{fired} of {fired} edges, one frame each")
