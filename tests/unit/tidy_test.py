#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs clang-tidy on the lines that were changed: by the last commit (on a branch: since it left main) and in the
working tree. Old findings do not fail a change beside them; `cmake --preset tidy` looks at everything.
Usage: tidy_test.py CLANG-TIDY BUILD [SECONDS]. Files that do not fit into SECONDS (default 50) are named and left out.
Exit status: 0 no complaint, 1 complaints, 77 cannot be done here."""
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
tidy, build = sys.argv[1], pathlib.Path(sys.argv[2])
end = time.monotonic() + (float(sys.argv[3]) if len(sys.argv) > 3 else 50)


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def git(*arguments):
    done = subprocess.run(["git", "-C", str(ROOT), *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return done.stdout.strip() if done.returncode == 0 else ""


if not tidy or tidy.endswith("NOTFOUND"):
    skip("clang-tidy-14 is not installed")
if git("rev-parse", "--show-toplevel") != str(ROOT):
    skip("not a git checkout")
base = git("merge-base", "HEAD", "main")
if base == git("rev-parse", "HEAD") or not base:
    base = git("rev-parse", "HEAD^")
if not base:
    skip("there is no commit to compare with")

# Which lines of which files are new.
lines = {}
name = None
for line in git("diff", "--unified=0", "--no-color", base, "--", "*.cpp", "*.hpp").splitlines():
    if line.startswith("+++ "):
        name = line[6:] if line.startswith("+++ b/") else None
    hunk = re.match(r"@@ -\S+ \+(\d+)(?:,(\d+))? @@", line)
    if hunk and name:
        first, count = int(hunk[1]), int(hunk[2] or 1)
        if count:
            lines.setdefault(name, []).append([first, first + count - 1])

database = json.loads((build / "compile_commands.json").read_text())
known = {os.path.relpath(entry["file"], ROOT) for entry in database}
# A header is seen through the source file of its name, or else through the first one that includes it.
sources = [file for file in lines if file in known]
for header in (file for file in lines if file.endswith(".hpp")):
    beside = header[:-4] + ".cpp"
    includes = f'#include "{header}"'
    users = [beside] if beside in known else (f for f in sorted(known) if not f.startswith("..") and includes in (ROOT / f).read_text())
    user = next(iter(users), None)
    if user and user not in sources:
        sources.append(user)
if not sources:
    print("no changed line of C++")
    sys.exit(0)
# Without GCC's precompiled headers, which clang cannot read: a source file has to include what it uses.
for entry in database:
    entry["command"] = re.sub(r" -Winvalid-pch -include (\"[^\"]+\"|\S+)", "", entry["command"])
folder = tempfile.TemporaryDirectory()
(pathlib.Path(folder.name) / "compile_commands.json").write_text(json.dumps(database))
line_filter = json.dumps([{"name": str(ROOT / file), "lines": ranges} for file, ranges in lines.items()])


def look(file):
    left = end - time.monotonic()
    if left <= 0:
        return file, None
    try:
        done = subprocess.run([tidy, "-p", folder.name, "--quiet", f"--line-filter={line_filter}", "--extra-arg=-Wno-error",
                               "--extra-arg=-Wno-unknown-warning-option", str(ROOT / file)],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=left)
    except subprocess.TimeoutExpired:
        return file, None
    return file, re.findall(r"^\S.*(?:warning|error): .*$", done.stdout, re.MULTILINE)


complaints, left_out = set(), []
with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 1) as pool:
    for file, found in pool.map(look, sources):
        if found is None:
            left_out.append(file)
        else:
            complaints.update(found)
for complaint in sorted(complaints):
    print(complaint.replace(f"{ROOT}/", ""))
if left_out:
    print(f"no time for {len(left_out)} of {len(sources)} files: {' '.join(left_out)}")
print(f"{len(sources) - len(left_out)} files looked at since {base[:10]}: {len(complaints)} complaints")
sys.exit(1 if complaints else 0)
