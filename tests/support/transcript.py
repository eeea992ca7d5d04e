# SPDX-License-Identifier: Apache-2.0
"""Commands of documents, run as a reader would: in one shell, with the built programs on PATH. The tests run in a network of
their own (in_private_network), so that the commands find the default ports free.

What is expected is a list of lines, in which … stands for anything and blanks for any number of blanks; they must come in
this order, and others may come between them.
"""
import os
import pathlib
import re
import subprocess
import sys

MARK = "@@transcript@@"


class Shell:
    """Runs lists of commands in the folder `work` with OBSCURA and OBSCURAD on PATH; `tools` is an empty folder for these.
    Commands that start the daemon in the background return when it is ready."""

    def __init__(self, obscura, obscurad, work, tools):
        self.work, self.ready = pathlib.Path(work), pathlib.Path(tools) / "ready"
        tools = pathlib.Path(tools)
        for name, target in (("obscura", obscura), ("python3", sys.executable)):
            (tools / name).symlink_to(pathlib.Path(target).absolute())
        daemon = tools / "obscurad"
        daemon.write_text(f'#!/bin/sh\nexec "{pathlib.Path(obscurad).absolute()}" --ready-file "{self.ready}" "$@"\n')
        daemon.chmod(0o755)
        self.environment = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}", "COLUMNS": "100"}

    def run(self, commands, timeout_s=300):
        """Returns a list with one (output, exit status) for each command."""
        script = []
        for number, command in enumerate(commands):
            script.append(f"echo; echo '{MARK} {number}'")
            script.append(command)
            script.append(f"status_of_command=$?; echo; echo \"{MARK} status $status_of_command\"")
            if re.match(r"\s*obscurad\b.*&\s*$", command):
                # Also ends when the daemon has ended.
                script.append(f"until [ -s '{self.ready}' ] || ! kill -0 $!; do sleep 0.05; done; rm -f '{self.ready}'")
        # What is still running then would keep the output open.
        script.append("kill $(jobs -p) 2>/dev/null; wait")
        text = "\n".join(script) + "\n"
        shell = subprocess.Popen(["bash", "--norc", "-c", text], cwd=self.work, env=self.environment, stdin=subprocess.DEVNULL,
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                                 start_new_session=True)
        try:
            output, _ = shell.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            os.killpg(shell.pid, 9)
            output, _ = shell.communicate()
            output += f"\nnot finished after {timeout_s} s\n"
        results = []
        for part in re.split(rf"^{MARK} \d+$", output, flags=re.MULTILINE)[1:]:
            status = re.search(rf"^{MARK} status (\d+)$", part, re.MULTILINE)
            said = re.sub(rf"^{MARK} status \d+$", "", part, flags=re.MULTILINE)
            results.append((said.strip("\n"), int(status[1]) if status else None))
        return results


def blanks(line):
    return " ".join(line.split())


def pattern_of(line, loose_numbers):
    """Regular expression for an expected line."""
    out = ""
    for part in re.split(r"(…|[-+]?\d+\.\d+(?:e[-+]\d+)?)" if loose_numbers else "(…)", blanks(line)):
        if part == "…":
            out += ".*"
        else:
            out += r"[-+]?\d+(?:\.\d+)?(?:e[-+]\d+)?" if loose_numbers and re.fullmatch(r"[-+]?\d+\.\d.*", part) else re.escape(part)
    return re.compile(out)


def missing_lines(expected, output, loose_numbers=False):
    """Those of the expected lines that the output does not have, in their order. With loose_numbers a number with a decimal
    point stands for any number."""
    missing, lines = [], iter([blanks(line) for line in output.splitlines()])
    for line in expected:
        pattern = pattern_of(line, loose_numbers)
        if not any(pattern.fullmatch(said) for said in lines):
            missing.append(line)
            lines = iter([])
    return missing
