#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Typed calls of the clients, made from the tables of calls of server and daemon, which `describe` gives.

Usage: generate.py OBSCURA OBSCURAD SOURCE-DIRECTORY [--update]
Without --update the committed files are compared: exit status 1 if one differs, 77 without numpy.
"""
import pathlib
import sys

try:
    import numpy  # noqa: F401
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)

obscura, obscurad, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
sys.path.insert(0, str(source / "clients" / "python"))
import cpp_stubs  # noqa: E402
import java_stubs  # noqa: E402
import lua_stubs  # noqa: E402
import python_stubs  # noqa: E402
from call_table import calls_of  # noqa: E402
from described import all_calls  # noqa: E402

calls = calls_of(all_calls(obscura, obscurad))
wanted = {}
for writer in (python_stubs, java_stubs, lua_stubs, cpp_stubs):
    wanted.update(writer.write(calls))
# What the folder of Java's stubs has besides is of calls that are gone.
gone = {file.relative_to(source) for file in (source / java_stubs.FOLDER).glob("*.java")} - {pathlib.Path(f) for f in wanted}

wrong = sorted(str(file) for file in gone)
for file, text in wanted.items():
    path = source / file
    if path.exists() and path.read_text() == text:
        continue
    wrong.append(str(file))
    if "--update" in sys.argv:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
if "--update" in sys.argv:
    for file in gone:
        (source / file).unlink()
elif wrong:
    print(f"{', '.join(wrong)}: not what server and daemon describe; run {sys.argv[0]} with --update")
    sys.exit(1)
print(f"{len(calls)} calls, the stubs are those of server and daemon")
