#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Raises a simulated GPIO line COUNT times, PERIOD-S apart with a normal jitter of RMS-S: jitter_edges.py FILE COUNT PERIOD-S RMS-S"""
import pathlib
import random
import sys
import time

pull, count, period_s, rms_s = pathlib.Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), float(sys.argv[4])
random.seed(11)
begin = time.monotonic() + period_s
for k in range(count):
    at = begin + k * period_s + random.gauss(0, rms_s)
    time.sleep(max(0.0, at - 0.002 - time.monotonic()))
    while time.monotonic() < at:
        pass
    pull.write_text("pull-up")
    time.sleep(period_s / 3)
    pull.write_text("pull-down")
