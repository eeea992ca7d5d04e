#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""README.md: its first steps work when they are pasted, and `. scripts/env` puts the programs on PATH.
Usage: first_steps_test.py OBSCURA OBSCURAD SOURCE"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import transcript  # noqa: E402

obscura, obscurad, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


section = re.search(r"^## First steps\n(.*?)^## ", (source / "README.md").read_text(), re.MULTILINE | re.DOTALL)[1]
steps = re.findall(r"^    (.+?)\s*(?:# .*)?$", section, re.MULTILINE)
check("the first step is scripts/env", steps[:1] == [". scripts/env"], steps[:1])

with tempfile.TemporaryDirectory(prefix="obscura-first-steps-") as temporary:
    folder = pathlib.Path(temporary)
    checkout = folder / "a checkout"
    (checkout / "scripts").mkdir(parents=True)
    shutil.copy(source / "scripts/env", checkout / "scripts/env")
    for shell, sourced, place in (("bash", "scripts/env", checkout), ("bash", f"'{checkout}/scripts/env'", folder), ("sh", "./scripts/env", checkout)):
        def call(then):
            return subprocess.run([shell, "-c", f". {sourced} {then}"], cwd=place, capture_output=True, text=True)

        shutil.rmtree(checkout / "build", ignore_errors=True)
        done = call("&& echo built || echo not built")
        check(f"{shell}, {sourced}: says how to build what is not built", done.stdout == "not built\n" and "scripts/demo" in done.stderr, done)
        for name in ("tools/obscura", "emulator/obscurad"):
            program = checkout / "build/release" / name
            program.parent.mkdir(parents=True, exist_ok=True)
            program.write_text(f"#!/bin/sh\necho {program.name} of the checkout\n")
            program.chmod(0o755)
        done = call("&& obscura && obscurad && echo \"left: $obscura_build$obscura_checkout\"")
        check(f"{shell}, {sourced}: puts the programs on PATH", done.stdout == "obscura of the checkout\nobscurad of the checkout\nleft: \n", done)

    work, tools = folder / "work", folder / "tools"
    work.mkdir()
    tools.mkdir()
    (work / "config").symlink_to(source / "config")
    results = transcript.Shell(obscura, obscurad, work, tools).run(steps[1:])
    check("all steps are run", len(results) == len(steps) - 1, results)
    for step, (output, status) in zip(steps[1:], results):
        check(f"$ {step}", status == 0, f"status {status}\n{output}")
    said = "\n".join(output for output, _ in results)
    missing = transcript.missing_lines(["config/demo.toml: good: …", "written demo.exr", "frames 25", "incomplete 0", "…ExposureTime…"], said)
    check("and print what they should", not missing, f"{missing}\n{said}")
    check("and leave what they should", (work / "demo.exr").is_file() and len(list((work / "frames").glob("frame_*.png"))) >= 25)

sys.exit(1 if failures else 0)
