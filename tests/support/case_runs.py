# SPDX-License-Identifier: Apache-2.0
"""Runs of the case studies (tests/cases) and checks of what they found. Failures are printed and counted."""
import importlib.util
import json
import pathlib
import subprocess
import sys
import tempfile

CASES = pathlib.Path(__file__).resolve().parents[1] / "cases"
SKIPPED = 77
obscura = sys.argv[1]
failures = []
if not importlib.util.find_spec("numpy"):
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(SKIPPED)


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def case(script, *arguments):
    """Exit status, what it printed and its figures."""
    with tempfile.TemporaryDirectory() as folder:
        figures = pathlib.Path(folder) / "figures.json"
        done = subprocess.run([sys.executable, "-B", CASES / script, obscura, "--json", figures, *map(str, arguments)],
                              capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr, json.loads(figures.read_text()) if figures.exists() else {}
