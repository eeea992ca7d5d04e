#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The examples of the C and C++ clients make the pictures of the Python client's.

Usage: native_examples_test.py OBSCURA SOURCE-DIRECTORY FOLDER-OF-THE-EXAMPLES
Exit status 1 if a check failed, 77 without numpy.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

try:
    import numpy  # noqa: F401
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)

obscura, source, programs = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3]).resolve()
environment = {**os.environ, "OBSCURA": obscura, "PYTHONPATH": str(source / "clients" / "python")}
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def run(*command, **changes):
    return subprocess.run([str(word) for word in command], text=True, capture_output=True, env={**environment, **changes}, cwd=temporary)


with tempfile.TemporaryDirectory(prefix="obscura-examples-") as temporary:
    wanted = run(sys.executable, source / "clients/python/examples/rendezvous.py", "3", temporary).stdout
    check("the rendezvous in Python", wanted.count("\n") == 4, wanted)
    for language in "c", "cpp":
        (pathlib.Path(temporary) / "rendezvous.toml").unlink()
        flown = run(programs / f"obscura_client_rendezvous_{language}", "3", temporary)
        check(f"the rendezvous in {language}", flown.returncode == 0 and flown.stdout == wanted, flown)
        check(f"its last scene is a scene file ({language})", run(obscura, "check", "rendezvous.toml").returncode == 0)
        first = run(programs / f"obscura_client_first_{language}")
        depths = [float(depth) for depth in re.findall(r"nearest surface ([\d.]+) m", first.stdout)]
        check(f"the first example in {language}", first.returncode == 0 and depths == [39.0 - step for step in range(10)], first)
        none = run(programs / f"obscura_client_rendezvous_{language}", "1", OBSCURA=temporary + "/none")
        check(f"no program ({language})", none.returncode == 1 and "environment variable OBSCURA" in none.stderr, none)

print(f"{len(failures)} checks failed")
sys.exit(1 if failures else 0)
