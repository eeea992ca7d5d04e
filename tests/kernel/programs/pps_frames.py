#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tells a PPS source one pulse a second, each with the instant that it stands for, and looks at the frames that a daemon in
step with them makes: pps_frames.py FILE FRAMES-FOLDER RATE PULSES

Every frame between the first pulse and the last must lie at pulse + k/RATE. Prints how many of the slots have one on the first
line of its output and fails with less than half (on a busy machine a tenth): an emulated machine may be too slow for some, which
the daemon has to count.
"""
import os
import pathlib
import re
import sys
import time

TOLERANCE_NS = 1_000_000  # the daemon's and this program's readings of how far the clocks are apart
file, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
rate, count = int(sys.argv[3]), int(sys.argv[4])


def real_less_monotonic():
    readings = []
    for _ in range(20):
        before = time.monotonic_ns()
        real = time.time_ns()
        after = time.monotonic_ns()
        readings.append((after - before, real - (before + after) // 2))
    return min(readings)[1]


first = (time.time_ns() // 10**9 + 1) * 10**9
for k in range(count):
    time.sleep(max(0, (first + k * 10**9 - time.time_ns()) / 1e9))
    file.write_text(str(first + k * 10**9))
wanted = rate * (count - 1)
edges = {}
end = time.monotonic() + 3
while len(edges) < wanted and time.monotonic() < end:
    time.sleep(0.2)
    for told in sorted(folder.glob("frame_*.toml")):
        text = told.read_text()
        edge, trigger = re.search(r"^T_EDGE *= *(\d+)\b.*\n", text, re.M), re.search(r"^TRIGID *= *(\d+)\b", text, re.M)
        if edge and trigger and int(trigger[1]) <= wanted:
            edges[int(trigger[1])] = int(edge[1])
if len(edges) < wanted / (10 if os.environ.get("RIG_BUSY") else 2):
    sys.exit(f"slots without a frame: {[m for m in range(1, wanted + 1) if m not in edges]}")
difference = real_less_monotonic()
off = {m: abs(edges[m] + difference - first - (m - 1) * 10**9 // rate) for m in edges}
worst = max(off, key=off.get)
if off[worst] > TOLERANCE_NS:
    sys.exit(f"slot {worst} is {off[worst] / 1e6:.1f} ms from pulse + k/{rate}")
print(f"{len(edges)} of {wanted} slots at pulse + k/{rate} have a frame, at most {off[worst] / 1e3:.0f} us off")
