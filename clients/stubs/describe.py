#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The table of calls, clients/calls.json, of what server and daemon `describe`; all stubs are made from it.

Usage: describe.py OBSCURA OBSCURAD SOURCE-DIRECTORY [--update]
Without --update the committed table is compared: exit status 1 if it differs, 77 without numpy.
"""
import json
import pathlib
import sys

try:
    import numpy  # noqa: F401
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)

obscura, obscurad, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
sys.path.insert(0, str(source / "clients" / "python"))
from described import calls_of_daemon, calls_of_server  # noqa: E402

table = {"server": calls_of_server(obscura), "daemon": calls_of_daemon(obscurad)}
file = source / "clients" / "calls.json"
if "--update" in sys.argv:
    file.write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n")
elif json.loads(file.read_text()) != table:
    committed = json.loads(file.read_text())
    for side, calls in table.items():
        before = {call["name"]: call for call in committed.get(side, [])}
        now = {call["name"]: call for call in calls}
        for name in sorted({*before, *now}):
            if before.get(name) != now.get(name):
                print(f"clients/calls.json: {name} of the {side} is not what describe says")
    print(f"run {sys.argv[0]} with --update, and configure again: cmake --preset release")
    sys.exit(1)
print(f"{sum(map(len, table.values()))} calls, clients/calls.json is what server and daemon describe")
