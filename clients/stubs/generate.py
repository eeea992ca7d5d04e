#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the typed calls of the clients, in C++, Java, Lua and Python, from the table of calls in clients/calls.json.

Usage: generate.py [SOURCE-DIRECTORY]
The files lie in the folders of the clients and are not committed; CMake runs this when it configures. Files that are right
already are left alone, those of calls that are gone are removed. describe.py makes the table.
"""
import json
import os
import pathlib
import sys

source = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(source / "clients" / "stubs"))
import cpp_stubs  # noqa: E402
import java_stubs  # noqa: E402
import lua_stubs  # noqa: E402
import python_stubs  # noqa: E402
from call_table import calls_of, each_once  # noqa: E402

calls = calls_of(each_once(json.loads((source / "clients" / "calls.json").read_text())))
wanted = {}
for writer in (python_stubs, java_stubs, lua_stubs, cpp_stubs):
    wanted.update(writer.write(calls))
for file in (source / java_stubs.FOLDER).glob("*.java"):
    if file.relative_to(source) not in {pathlib.Path(name) for name in wanted}:
        file.unlink()
for name, text in wanted.items():
    path = source / name
    if path.exists() and path.read_text() == text:
        continue
    path.parent.mkdir(parents=True, exist_ok=True)
    # Builds of one checkout may do this at the same time.
    own = path.with_name(f"{path.name}.{os.getpid()}")
    own.write_text(text)
    own.replace(path)
