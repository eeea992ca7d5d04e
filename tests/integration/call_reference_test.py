#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The reference of calls: docs/reference/calls.md holds what the server's `describe` says.

Usage: call_reference_test.py OBSCURA SOURCE-DIRECTORY [--update]
Exit status 1 if the page differs, 77 without numpy.
"""
import pathlib
import sys

try:
    import numpy  # noqa: F401
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)

obscura, source = sys.argv[1], pathlib.Path(sys.argv[2])
sys.path.insert(0, str(source / "clients" / "python"))
import obscura_client  # noqa: E402


def cell(text):
    return str(text).replace("|", "\\|")


def table(heads, rows):
    lines = [f"| {' | '.join(heads)} |", f"|{' --- |' * len(heads)}"]
    return lines + [f"| {' | '.join(cell(c) for c in row)} |" for row in rows] + [""]


with obscura_client.start(program=obscura) as camera:
    described = camera.describe()
lines = ["# Calls of the rendering server", "",
         "Generated from the server's `describe`; do not edit. What the calls are for, the Python client and the protocol are in",
         "[clients.md](../clients.md); the keys of scenes in [scene.md](scene.md).", ""]
for call in described["calls"]:
    lines += [f"## {call['name']}", "", f"{call['help']} Permission: {call['permission']}.", ""]
    if call["fields"]:
        lines += table(["field", "type", "allowed", "default", "meaning"],
                       [(f"`{f['name']}`", f["type"], f.get("allowed", ""),
                         "required" if f.get("required") else f"`{f['default']}`" if "default" in f else "", f["help"])
                        for f in call["fields"]])
    if call["results"]:
        lines += table(["result", "type", "unit", "meaning"],
                       [(f"`{r['name']}`", r["type"], r.get("unit", ""), r["help"]) for r in call["results"]])
page, file = "\n".join(lines).rstrip("\n") + "\n", source / "docs" / "reference" / "calls.md"
if "--update" in sys.argv:
    file.write_text(page)
elif not file.exists() or file.read_text() != page:
    print(f"{file}: differs from what `obscura serve` describes; run {sys.argv[0]} with --update")
    sys.exit(1)
print("the reference of calls is that of the server")
