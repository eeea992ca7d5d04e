#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The client for Octave: its own checks, and the rendezvous beside the Python client's.

Usage: octave_client_test.py OBSCURA SOURCE-DIRECTORY [FOLDER-OF-THE-MEX-FUNCTION]
Exit status 1 if a check failed, 77 without Octave, its development files or numpy.
"""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

try:
    import numpy  # noqa: F401
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)
if len(sys.argv) < 4:
    print("skipped: no Octave with its development files when this was configured (Debian package octave-dev)")
    sys.exit(77)

obscura, source, mex = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve(), os.path.abspath(sys.argv[3])
client = source / "clients" / "octave"
environment = {**os.environ, "OBSCURA": obscura, "PYTHONPATH": str(source / "clients" / "python")}
failed = 0
with tempfile.TemporaryDirectory(prefix="obscura-octave-") as folder:

    def run(*command):
        done = subprocess.run([str(word) for word in command], text=True, capture_output=True, env=environment, cwd=folder)
        if done.returncode != 0:
            print(f"NOT OK - {command}: status {done.returncode}\n{done.stdout}{done.stderr}")
        return done

    octave = ["octave-cli", "--no-init-file", "--path", client, "--path", mex]
    checks = run(*octave, source / "tests" / "clients" / "octave_client.m")
    print(checks.stdout, end="")
    flown = run(*octave, "--path", client / "examples", "--eval", "rendezvous(3, '.')")
    wanted = run(sys.executable, source / "clients" / "python" / "examples" / "rendezvous.py", "3", folder)
    same = flown.stdout.splitlines() == wanted.stdout.splitlines()[:3] and len(flown.stdout.splitlines()) == 3
    print(f"{'ok' if same else 'NOT OK'} - the rendezvous is that of Python")

    # The section of the page begins with the first example.
    page = (source / "docs" / "clients.md").read_text().split("\n### Octave and MATLAB\n\n")[1].split("\n\nis ")[0]
    shown = [line[4:] for line in page.splitlines()]
    first = [line for line in (client / "examples" / "first.m").read_text().splitlines() if line and not line.startswith("%")]
    nearer = run(*octave, client / "examples" / "first.m").stdout.split("\n")
    good = shown == first and nearer[0] == "nearest surface 39.000 m" and nearer[9] == "nearest surface 30.000 m"
    print(f"{'ok' if good else 'NOT OK'} - the first example is that of the page: {nearer}")

    # Ctrl-C ends the render and then the script, not the connection.
    slow = """camera = obscura_start('demo', 'threads', 1); disp('begins'); fflush(stdout);
              unwind_protect, obscura_render(camera, 'width', 2048, 'height', 1536, 'samples', 65536); disp('whole');
              unwind_protect_cleanup, disp(obscura_call(camera, 'status').waiting); end_unwind_protect"""
    script = subprocess.Popen([*octave, "--eval", slow], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment)
    script.stdout.readline()
    time.sleep(0.5)
    script.send_signal(signal.SIGINT)
    said = script.communicate(timeout=200)[0]
    interrupted = script.returncode == 1 and said == "0\n"
    print(f"{'ok' if interrupted else 'NOT OK'} - Ctrl-C ends the render, not the connection: {script.returncode} {said!r}")
    failed = not interrupted or not good or checks.returncode != 0 or flown.returncode != 0 or not same
sys.exit(1 if failed else 0)
