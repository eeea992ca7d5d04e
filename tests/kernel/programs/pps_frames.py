#!/usr/bin/env python3
"""Tells a PPS source one pulse a second, each with the instant that it stands for, and looks at the frames that a daemon in
step with them makes: pps_frames.py FILE FRAMES-FOLDER RATE PULSES

Fails unless there is a frame for each of the RATE slots of every second between the first pulse and the last, at pulse + k/RATE.
"""
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
end = time.monotonic() + 20
while len(edges) < wanted and time.monotonic() < end:
    time.sleep(0.2)
    for told in sorted(folder.glob("frame_*.toml")):
        text = told.read_text()
        edge, trigger = re.search(r"^T_EDGE *= *(\d+)\b.*\n", text, re.M), re.search(r"^TRIGID *= *(\d+)\b", text, re.M)
        if edge and trigger and int(trigger[1]) <= wanted:
            edges[int(trigger[1])] = int(edge[1])
missing = [m for m in range(1, wanted + 1) if m not in edges]
if missing:
    sys.exit(f"slots without a frame: {missing}")
difference = real_less_monotonic()
off = [abs(edges[m] + difference - first - (m - 1) * 10**9 // rate) for m in range(1, wanted + 1)]
if max(off) > TOLERANCE_NS:
    sys.exit(f"slot {off.index(max(off)) + 1} is {max(off) / 1e6:.1f} ms from pulse + k/{rate}")
print(f"{wanted} of {wanted} slots at pulse + k/{rate} have a frame, at most {max(off) / 1e3:.0f} us off")
