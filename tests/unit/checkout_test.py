#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests write to temporary folders and to the build folder only, so that a checkout is as clean after them as before.

Usage: checkout_test.py                       test: no script of tests/ writes below its own checkout, but with --update
       checkout_test.py --note FILE           before a run of ctest: notes what git does not track (CTestCustom.cmake)
       checkout_test.py --compare FILE        after it: names what has come since, exit status 1
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
WRITES = r"\.(?:write_text|write_bytes|mkdir|touch|symlink_to|unlink|rename)\("


def left_files():
    """Files that git does not track, also those that .gitignore names, but for builds and Python's own; none without git."""
    told = subprocess.run(["git", "-C", str(ROOT), "status", "--porcelain", "--ignored", "--untracked-files=all"],
                          capture_output=True, text=True)
    if told.returncode != 0:
        return None
    kinds = {line[3:].strip('"') for line in told.stdout.splitlines() if line[:2] in ("??", "!!", " D")}
    return {name for name in kinds if not re.search(r"^build(-[^/]*)?/|__pycache__|^\.cache/|/calls?/|calls\.(py|hpp|lua)$", name)}


def own_names(text):
    """Names in a script that stand for its checkout: made from __file__, or from those."""
    names = set(re.findall(r"^([A-Za-z_]+)\s*=.*__file__", text, re.MULTILINE))
    for name in sorted(names):
        names |= set(re.findall(rf"^([A-Za-z_]+)\s*=\s*\(?{name}\b\s*/", text, re.MULTILINE))
    return names


def writers():
    found = []
    for path in sorted((ROOT / "tests").rglob("*.py")):
        text = path.read_text()
        if "--update" in text or path == pathlib.Path(__file__).resolve():
            continue
        for name in own_names(text):
            for number, line in enumerate(text.splitlines(), 1):
                if re.search(rf"\(?\b{name}\b(?:\s*/[^()]*)*\)?{WRITES}", line) or \
                   re.search(rf"open\(\s*{name}\b[^)]*,\s*[\"'][wax]", line):
                    found.append(f"{path.relative_to(ROOT)}:{number}: writes below {name}, the checkout: {line.strip()[:80]}")
    for path in sorted((ROOT / "tests").rglob("*.cpp")):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if "OBSCURA_SOURCE_DIR" in line and re.search(r"ofstream|create_director|O_CREAT", line):
                found.append(f"{path.relative_to(ROOT)}:{number}: writes below OBSCURA_SOURCE_DIR: {line.strip()[:80]}")
    return found


if len(sys.argv) == 3 and sys.argv[1] == "--note":
    files = left_files()
    if files is not None:
        pathlib.Path(sys.argv[2]).write_text("\n".join(sorted(files)))
elif len(sys.argv) == 3 and sys.argv[1] == "--compare":
    before, files = pathlib.Path(sys.argv[2]), left_files()
    new = sorted(files - set(before.read_text().split("\n"))) if files is not None and before.exists() else []
    for name in new:
        print(f"{ROOT / name}: left by the tests, which write to temporary folders only", file=sys.stderr)
    before.unlink(missing_ok=True)
    pathlib.Path(f"{before}.left").write_text("\n".join(new))
    sys.exit(1 if new else 0)
else:
    assert own_names("ROOT = pathlib.Path(__file__)\nOUT = ROOT / 'x'\n") == {"ROOT", "OUT"}
    found = writers()
    for line in found:
        print(line)
    if not found:
        print("tests write to temporary folders only")
    sys.exit(1 if found else 0)
