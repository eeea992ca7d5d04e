#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tests/bench/validation.py without what it needs: one line, exit status 77 and no page.

Usage: validation_test.py SOURCE-DIRECTORY
Exit status 1 if a check failed.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

bench = pathlib.Path(sys.argv[1]) / "tests/bench"
failures = 0


def check_skipped(what, path, hide_numpy, words):
    global failures
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "validation.md"
        script = (f"import runpy, sys; sys.path.insert(0, {str(bench)!r}); "
                  f"sys.argv = ['validation.py', '/nowhere', '--output', {str(page)!r}]; "
                  + ("sys.modules['numpy'] = None; " if hide_numpy else "") +
                  f"runpy.run_path({str(bench / 'validation.py')!r}, run_name='__main__')")
        done = subprocess.run([sys.executable, "-c", script], env={**os.environ, "PATH": path}, capture_output=True, text=True,
                              check=False)
        good = (done.returncode == 77 and done.stdout.count("\n") == 1 and words in done.stdout and not done.stderr and
                not page.exists())
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good else f': {done.returncode} {done.stdout}{done.stderr}'}")
    failures += not good


with tempfile.TemporaryDirectory() as tools:
    check_skipped("without Blender", tools, False, "blender is not installed")
    # A Blender whose Python fails to import anything.
    blender = pathlib.Path(tools) / "blender"
    blender.write_text('#!/bin/sh\nwhile [ $# -gt 0 ]; do [ "$1" = --python-exit-code ] && exit "$2"; shift; done\n')
    blender.chmod(0o755)
    check_skipped("without numpy", tools, True, "Python's numpy is not installed")
    try:
        import numpy  # noqa: F401
    except ImportError:
        print("SKIPPED: a Blender without numpy, because this Python has none")
    else:
        check_skipped("without numpy in Blender", tools, False, "within Blender has no numpy")
sys.exit(1 if failures else 0)
