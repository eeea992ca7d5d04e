#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the case studies of terrains with small pictures: the landscape, which needs no data, and the flyby to the lunar south pole.

Usage: cases_terrain_test.py OBSCURA
Exit status 77 where numpy is missing; without the data of the Moon only the landscape is tested.
"""
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from case_runs import SKIPPED, case, check, failures  # noqa: E402

status, said, figures = case("landscape.py", "--size", "240x150", "--samples", 2)
check("a landscape's depth, slopes and hazards are those of its maps", status == 0, said)
check("the overlap of its maps is stated", "mean" in str(figures.get("maps where they overlap")), said)
status, said, figures = case("landscape.py", "--made", "--size", "160x100", "--samples", 1)
check("a made landscape is the same from two places, and its slopes are those of its table", status == 0, said)
status, said, figures = case("lunar_south_pole.py", "--size", 48, "--samples", 2, "--sheet", "2,32,1")
if status == SKIPPED:
    print(said.strip())
else:
    check("the flyby to the lunar south pole is over its three maps", status == 0, said)
    status, said, figures = case("descent.py", "--frames", 4, "--size", 24, "--samples", 1, "--tested", "1e9,1e6,1e4,10")
    check("nothing pops up on the way down to the Moon", status == 0, said)
sys.exit(1 if failures else 0)
