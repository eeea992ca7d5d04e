#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the case studies of terrains with small pictures: the landscape, which needs no data, and the flyby to the lunar south pole.

Usage: cases_terrain_test.py OBSCURA
Exit status 77 where numpy is missing; without the data of the Moon only the landscape is tested.
"""
import importlib.util
import json
import pathlib
import subprocess
import sys
import tempfile

CASES = pathlib.Path(__file__).resolve().parents[1] / "cases"
obscura = sys.argv[1]
if not importlib.util.find_spec("numpy"):
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def case(script, *arguments):
    """Exit status, what it printed and its figures."""
    with tempfile.TemporaryDirectory() as folder:
        figures = pathlib.Path(folder) / "figures.json"
        done = subprocess.run([sys.executable, "-B", CASES / script, obscura, "--json", figures, *map(str, arguments)],
                              capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr, json.loads(figures.read_text()) if figures.exists() else {}


status, said, figures = case("landscape.py", "--size", "240x150", "--samples", 2)
check("a landscape's depth, slopes and hazards are those of its maps", status == 0, said)
check("the overlap of its maps is stated", "mean" in str(figures.get("maps where they overlap")), said)
status, said, figures = case("lunar_south_pole.py", "--size", 48, "--samples", 2, "--sheet", "2,32,1")
if status == 77:
    print(said.strip())
else:
    check("the flyby to the lunar south pole is over its three maps", status == 0, said)
sys.exit(1 if failures else 0)
