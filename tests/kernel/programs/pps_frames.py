#!/usr/bin/env python3
"""Fires one pulse a second and looks at the frames that a daemon in step with it makes: pps_frames.py FILE FRAMES-FOLDER
RATE PULSES

Fails unless frames lie at pulse + k/RATE and pulses have frames with their own time stamps. An emulated machine beside other
work may be too slow for some.
"""
import pathlib
import re
import sys
import time

file, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
rate, count = int(sys.argv[3]), int(sys.argv[4])
pulses = []
start = time.monotonic_ns() + 200_000_000
for k in range(count):
    time.sleep(max(0, (start + k * 1_000_000_000 - time.monotonic_ns()) / 1e9))
    before = time.monotonic_ns()
    file.write_text("1")
    pulses.append((before, time.monotonic_ns()))
time.sleep(0.5)
edges = {}
for told in folder.glob("frame_*.toml"):
    text = told.read_text()
    edge, trigger = re.search(r"^T_EDGE *= *(\d+)\b", text, re.M), re.search(r"^TRIGID *= *(\d+)\b", text, re.M)
    if edge and trigger:
        edges[int(trigger[1])] = int(edge[1])
wanted = rate * (count - 1)
found = [m for m in range(1, wanted + 1) if m in edges]
if len(found) < wanted / 2:
    sys.exit(f"only {len(found)} of {wanted} triggers gave a frame: {found}")
exact = 0
for m in found:
    before, after = pulses[(m - 1) // rate]
    nominal = before + (m - 1) % rate * 1e9 / rate
    if (m - 1) % rate == 0 and before <= edges[m] <= after + 5_000_000:
        exact += 1
    # A pulse that this machine fired late has its frames where the one before let expect them.
    elif abs(edges[m] - nominal) > 150e6:
        sys.exit(f"trigger {m} has its edge {(edges[m] - nominal) / 1e6:.1f} ms from its place")
if exact < 3:
    sys.exit(f"only {exact} of {count - 1} pulses have a frame with their own time")
print(f"{len(found)} of {wanted} slots at {rate} Hz have frames in step with {count} pulses, {exact} with the pulse's own stamp")
