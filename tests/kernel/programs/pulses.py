#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Gives pulses on a simulated GPIO line to a daemon that exposes for as long as they last: pulses.py PULL FRAMES-FOLDER MS...

Fails when a pulse gives no frame, or one that does not begin with it or was not exposed for as long.
"""
import pathlib
import re
import sys
import time

pull = pathlib.Path(sys.argv[1])
folder = pathlib.Path(sys.argv[2])
slack_s = 0.05  # the simulated interrupt may come a little after the write has returned
apart_s = []
for number, width_ms in enumerate(map(float, sys.argv[3:]), 1):
    begin = time.monotonic()
    pull.write_text("pull-up")
    begun = time.monotonic()
    time.sleep(width_ms / 1e3)
    end = time.monotonic()
    pull.write_text("pull-down")
    ended = time.monotonic()
    told = folder / f"frame_{number:06}.toml"
    while True:
        text = told.read_text() if told.exists() else ""
        edge = re.search(r"^T_EDGE *= *(\d+)\b.*\n", text, re.M)
        exposure = re.search(r"^EXPOSURE *= *([0-9.eE+-]+)\b.*\n", text, re.M)
        if edge and exposure:
            break
        if time.monotonic() - begin > 20:
            sys.exit(f"pulse {number} gave no frame: {text}")
        time.sleep(0.005)
    if not begin <= int(edge[1]) / 1e9 <= begun + slack_s:
        sys.exit(f"frame {number} says its edge was at {edge[1]} ns, it was between {begin} and {begun} s")
    exposed = float(exposure[1])
    if not end - begun - slack_s <= exposed <= ended - begin + slack_s:
        sys.exit(f"frame {number} was exposed for {exposed} s, its pulse lasted {end - begun} to {ended - begin} s")
    apart_s.append(abs(exposed - (end - begin)))
print(f"{len(apart_s)} pulses, exposures within {max(apart_s) * 1e3:.1f} ms of what was sent")
