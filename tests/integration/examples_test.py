#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Starts every example of config/examples from a copy, by the commands at its top, and looks for what they print.

A header has an indented block of commands after "Run:" and one of lines after "Prints:"; those that need hardware have
another pair after "Without:", which is run instead.
Usage: examples_test.py OBSCURA OBSCURAD SOURCE [NAME...]
"""
import importlib.util
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import transcript  # noqa: E402
from checks import check, failures  # noqa: E402

obscura, obscurad, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
EXPECTED = {"mesh", "trajectory", "two-windows", "two-cameras", "udp-trigger", "gpio", "lockstep", "faults", "gstreamer", "opencv",
            "v4l2", "stimulator"}


def call(*arguments):
    done = subprocess.run([obscura, *arguments], capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def block(lines, word):
    """Indented lines after the last line that begins with `word`, without their indentation."""
    starts = [i for i, line in enumerate(lines) if line.startswith(word)]
    if not starts:
        return []
    found = []
    for line in lines[starts[-1] + 1:]:
        if not line.startswith("    "):
            break
        found.append(line[4:])
    return found


def why_not(name):
    """What an example needs that this machine does not have."""
    if name in ("gstreamer", "opencv"):
        for element in ("aravissrc", "pngenc") if name == "gstreamer" else ("aravissrc", "appsink"):
            if not shutil.which("gst-inspect-1.0") or subprocess.run(["gst-inspect-1.0", element], capture_output=True).returncode:
                return f"GStreamer has no {element}"
    if name == "opencv" and importlib.util.find_spec("cv2") is None:
        return "no python3-opencv"
    if name == "gpio" and shutil.which("gpioinfo") and "TRIG_IN" in subprocess.run(["gpioinfo"], capture_output=True, text=True).stdout:
        return "this machine has a GPIO line TRIG_IN"
    if name == "v4l2" and os.path.exists("/dev/video10"):
        return "this machine has a /dev/video10"
    return ""


status, listing, _ = call("examples")
check("obscura examples lists", status == 0, status)
listed = dict(re.findall(r"^(\S+) {2,}(\S.*)$", listing, re.MULTILINE))
folders = {folder.name for folder in (source / "config/examples").iterdir() if folder.is_dir()}
check("all that exist, with a line each", set(listed) == folders, (sorted(listed), sorted(folders)))
check("and those that are wanted exist", EXPECTED <= folders, sorted(EXPECTED - folders))
entries = {entry["name"]: entry for entry in json.loads(call("examples", "--json")[1])}

status, _, error = call("examples", "lockstop")
check("an unknown name gets those that there are", status == 64 and "lockstep" in error, error)
status, _, error = call("examples", "--copy", "x")
check("--copy needs a name", status == 64 and "NAME" in error, error)

# As installed: PREFIX/bin and PREFIX/share/obscura. Few enough, so that those of the source tree would be noticed.
with tempfile.TemporaryDirectory(prefix="obscura-examples-", dir=os.path.dirname(obscura)) as temporary:
    prefix = pathlib.Path(temporary)
    (prefix / "bin").mkdir()
    os.link(obscura, prefix / "bin/obscura")
    for folder in ("scenes", "sensors", "stars", "examples/faults", "examples/lockstep"):
        shutil.copytree(source / "config" / folder, prefix / "share/obscura" / folder)
    (prefix / "share/obscura/examples/lockstep/scene.toml").chmod(0o444)

    def installed(*arguments):
        done = subprocess.run([prefix / "bin/obscura", *arguments], capture_output=True, text=True, cwd=prefix)
        return done.returncode, done.stdout, done.stderr

    said = installed("examples")[1]
    check("an installed program lists those installed beside it", re.findall(r"^(\S+) {2,}", said, re.MULTILINE) == ["faults", "lockstep"], said)
    for name in ("faults", "lockstep"):
        status, said, error = installed("examples", name, "--copy", name)
        check(f"and copies them: {name}", status == 0, error)
        status, said, error = installed("check", f"{name}/camera.toml")
        check(f"into files that are good: {name}", status == 0 and "good" in said, said + error)
    shutil.rmtree(prefix / "share/obscura/examples")
    status, _, error = installed("examples")
    check("and says what is missing where there are none", status == 66 and "share/obscura/examples" in error and error.count("\n") == 1, error)

with tempfile.TemporaryDirectory(prefix="obscura-examples-") as temporary:
    for name in sys.argv[4:] or sorted(listed):
        entry = entries[name]
        lines = entry["text"].splitlines()
        hardware = any(line.startswith("Without:") for line in lines)
        commands = block(lines, "Without:" if hardware else "Run:")
        expected = block(lines, "Prints:")
        check(f"{name}: says what it shows, needs, how to run it and what that prints",
              all(any(line.startswith(word) for line in lines) for word in ("Shows:", "Needs:", "Run:", "Prints:")) and commands and expected)
        if reason := why_not(name):
            print(f"skipped: {name}: {reason}")
            continue
        tools, work = pathlib.Path(temporary) / f"{name}.tools", pathlib.Path(temporary) / name
        tools.mkdir()
        status, said, error = call("examples", name, "--copy", str(work))
        check(f"{name}: is copied", status == 0 and (work / entry["file"]).is_file(), error)
        check(f"{name}: the report says how to run the copy", all(command in said for command in block(lines, "Run:")), said)
        status, _, error = call("examples", name, "--copy", str(work))
        check(f"{name}: and not overwritten", status == 64 and "not empty" in error, error)
        results = transcript.Shell(obscura, obscurad, work, tools).run(commands)
        output = "\n".join(said for said, _ in results)
        bad = [(command, status) for command, (_, status) in zip(commands, results) if status != 0]
        check(f"{name}: its commands succeed", not bad and len(results) == len(commands), f"{bad}\n{output}")
        missing = transcript.missing_lines(expected, output)
        check(f"{name}: and print what it says", not missing, f"not found: {missing}\n{output}")

sys.exit(1 if failures else 0)
