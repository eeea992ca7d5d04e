#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The references of calls: docs/reference/calls.md and camera-calls.md hold what server and daemon `describe`.

Usage: call_reference_test.py OBSCURA OBSCURAD SOURCE-DIRECTORY [--update]
Exit status 1 if a page differs, 77 without numpy.
"""
import pathlib
import sys

try:
    import numpy  # noqa: F401
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)

obscura, obscurad, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
sys.path[:0] = [str(source / "clients" / "python"), str(source / "clients" / "stubs")]
from described import calls_of_daemon, calls_of_server  # noqa: E402


def cell(text):
    return str(text).replace("|", "\\|")


def table(heads, rows):
    lines = [f"| {' | '.join(heads)} |", f"|{' --- |' * len(heads)}"]
    return lines + [f"| {' | '.join(cell(c) for c in row)} |" for row in rows] + [""]


def page(title, intro, calls):
    lines = [f"# {title}", "", *intro, ""]
    for call in calls:
        lines += [f"## {call['name']}", "", f"{call['help']} Permission: {call['permission']}.", ""]
        if call["fields"]:
            lines += table(["field", "type", "allowed", "default", "meaning"],
                           [(f"`{f['name']}`", f["type"], f.get("allowed", ""),
                             "required" if f.get("required") else f"`{f['default']}`" if "default" in f else "", f["help"])
                            for f in call["fields"]])
        for kind in ("frames", "results"):
            if call.get(kind):
                lines += table(["of each event \"frame\"" if kind == "frames" else "result", "type", "unit", "meaning"],
                               [(f"`{r['name']}`", r["type"], r.get("unit", ""), r["help"]) for r in call[kind]])
    return "\n".join(lines).rstrip("\n") + "\n"


served = calls_of_server(obscura)
every = [call["name"] for call in served[:served.index(next(c for c in served if c["name"] == "close")) + 1]]
pages = {
    "calls.md": page("Calls of the rendering server", [
        "Generated from the server's `describe`; do not edit. What the calls are for, the Python client and the protocol are in",
        "[clients.md](../clients.md); the keys of scenes in [scene.md](scene.md)."], served),
    "camera-calls.md": page("Calls of a running camera", [
        "Generated from the daemon's `describe`; do not edit. What the calls are for is in [control.md](../control.md); those that every",
        f"connection has ({', '.join(every)}) are in [calls.md](calls.md)."],
        [call for call in calls_of_daemon(obscurad) if call["name"] not in every]),
}
differ = False
for name, text in pages.items():
    file = source / "docs" / "reference" / name
    if "--update" in sys.argv:
        file.write_text(text)
    elif not file.exists() or file.read_text() != text:
        print(f"{file}: differs from what the program describes; run {sys.argv[0]} with --update")
        differ = True
if differ:
    sys.exit(1)
print("the references of calls are those of the programs")
