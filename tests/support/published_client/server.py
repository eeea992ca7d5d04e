# SPDX-License-Identifier: Apache-2.0
"""`obscura serve` with the door of the published client, and checks that print a line each."""
import pathlib
import signal
import subprocess
import sys

from children import Child

from .client import PublishedClient

PATIENCE_S = 120  # a busy machine, a sanitizer


class Checks:
    def __init__(self):
        self.failures = []

    def check(self, what, good, detail=""):
        print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not str(detail) else ': ' + str(detail)}", flush=True)
        if not good:
            self.failures.append(what)

    def near(self, what, got, wanted, limit):
        self.check(f"{what} ({got:.6g})", abs(got - wanted) <= limit, f"{got!r}, wanted {wanted!r} within {limit}")

    def refused(self, what, wanted, call):
        """`call` raises a line of error that has the text. Returns the line."""
        try:
            call()
        except RuntimeError as error:
            line = str(error)
            self.check(what, wanted in line and line.startswith("[error] ") and "\n" not in line, line)
            return line
        self.check(what, False, "was not refused")
        return ""

    def end(self):
        print(f"{len(self.failures)} checks failed")
        sys.exit(1 if self.failures else 0)


class Server:
    """Root and output folders below `folder`."""

    def __init__(self, obscura, folder, *words):
        self.root, self.output = pathlib.Path(folder) / "root", pathlib.Path(folder) / "output"
        for path in (self.root, self.output):
            path.mkdir(exist_ok=True)
        self.process = Child(
            [obscura, "serve", "--listen", "none", "--compatible", "127.0.0.1:0", "--root", self.root,
             "--output", self.output, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.port = int(self.process.stdout.readline().rsplit(":", 1)[1])

    def connect(self, **options):
        return PublishedClient("127.0.0.1", self.port, PATIENCE_S, **options)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()
