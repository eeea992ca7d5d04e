#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fires edges at a daemon and watches the lines that it drives: watch_lines.py LINES-FOLDER TRIGGER READY EXPOSURE
EXPOSURE-MS COUNT (numbers of lines of a simulated chip)

Fails unless the ready line is up before each edge and down during the exposure, and the exposure line is up once for each
edge, as long as the exposure.
"""
import pathlib
import sys
import time

folder = pathlib.Path(sys.argv[1])
trigger, ready, exposure = (folder / f"sim_gpio{n}" for n in sys.argv[2:5])
exposure_s, count = float(sys.argv[5]) * 1e-3, int(sys.argv[6])


def value(line):
    return (line / "value").read_text().strip() == "1"


def wait(what, line, level):
    end = time.monotonic() + 10
    while value(line) != level:
        if time.monotonic() > end:
            sys.exit(f"{what} stays {'down' if level else 'up'}")
    return time.monotonic()


widths = []
for number in range(1, count + 1):
    wait(f"edge {number}: ready", ready, True)
    if value(exposure):
        sys.exit(f"edge {number}: exposure is up before it")
    (trigger / "pull").write_text("pull-up")
    up = wait(f"edge {number}: exposure", exposure, True)
    if value(ready) and value(exposure):
        sys.exit(f"edge {number}: ready during the exposure")
    widths.append(wait(f"edge {number}: exposure", exposure, False) - up)
    (trigger / "pull").write_text("pull-down")
widths.sort()
middle = widths[len(widths) // 2]
if not 0.7 * exposure_s < middle < 1.5 * exposure_s + 0.02:
    sys.exit(f"the exposure line is up for {1e3 * middle:.1f} ms, wanted are {1e3 * exposure_s:.1f}")
print(f"{count} edges: ready before, exposing for {1e3 * middle:.1f} ms (median) of {1e3 * exposure_s:.1f}")
