# SPDX-License-Identifier: Apache-2.0
"""Checks of what a verb of the command line prints and refuses. Failures are printed and counted."""
import subprocess
import sys


class VerbChecks:
    """`command`: the program, and the words that stand before those of each call."""

    def __init__(self, *command):
        self.command = [str(word) for word in command]
        self.failures = []

    def fail(self, what, text):
        self.failures.append(what)
        print(f"FAILED: {what}: {text}")

    def run(self, *words, status=0):
        """Standard output, or standard error of a call that is to fail."""
        done = subprocess.run([*self.command, *map(str, words)], capture_output=True, text=True)
        if done.returncode != status:
            self.check(f"{words}: exit ({done.stderr.strip()})", done.returncode, status)
        return done.stdout if status == 0 else done.stderr

    def check(self, what, got, wanted):
        if got != wanted:
            self.fail(what, f"{got!r}, wanted {wanted!r}")

    def check_near(self, what, got, wanted, limit):
        if not abs(got - wanted) <= limit:
            self.fail(what, f"{got!r}, wanted {wanted!r} within {limit}")

    def check_refused(self, words, status, message):
        """One line that has the message."""
        lines = self.run(*words, status=status)
        self.check(f"{words}: one line", lines.count("\n"), 1)
        self.check(f"{words}: {lines!r} has {message!r}", message in lines, True)

    def end(self):
        print(f"{len(self.failures)} checks failed")
        sys.exit(1 if self.failures else 0)
