#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The reference of keys: docs/reference holds what `obscura keys` prints, and the loaders accept every key of it.

Usage: key_reference_test.py OBSCURA DOCS/REFERENCE [--update]
"""
import json
import pathlib
import subprocess
import sys
import tempfile

SCENE = '[[body]]\nshape = "ellipsoid"\nradii_m = [1, 1, 1]\nalbedo = 0.5\n'


def run(*arguments):
    return subprocess.run(arguments, capture_output=True, text=True)


def text_of(table):
    """The table with every key at its default, as TOML; required keys are left out."""
    lines = [table["table"]] if table["table"] else []
    lines += [f"{key['name']} = {key['default']}" for key in table["keys"] if not key["required"]]
    return "\n".join(lines) + "\n"


def main():
    obscura, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    complaints = []
    for kind in ("configuration", "scene", "sensor"):
        page = run(obscura, "keys", "--markdown", kind).stdout
        file = folder / f"{kind}.md"
        if "--update" in sys.argv:
            file.write_text(page)
        elif not file.exists() or file.read_text() != page:
            complaints.append(f"{file}: differs from `obscura keys --markdown {kind}`; run {sys.argv[0]} with --update")
    tables = json.loads(run(obscura, "keys", "--json").stdout)
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        (folder / "scene.toml").write_text(SCENE)
        for table in tables:
            if not table["keys"]:
                continue
            if table["file"] == "configuration":
                head = "" if table["table"] == "[scene]" else '[scene]\nfile = "scene.toml"\n'
                if table["table"] == "[camera.view]":
                    head += "[[camera]]\n"
                (folder / "c.toml").write_text(head + text_of(table))
                command = (obscura, "check", str(folder / "c.toml"))
            elif table["file"] == "scene":
                (folder / "s.toml").write_text(text_of(table))
                command = (obscura, "check", "--scene", str(folder / "s.toml"))
            else:
                (folder / "sensor.toml").write_text(text_of(table) if table["table"] else 'name = "x"\n' + text_of(table))
                command = (obscura, "sensor", "show", str(folder / "sensor.toml"))
            said = run(*command)
            strange = [line for line in said.stderr.splitlines() if "unknown key" in line]
            # A body's own keys are documented apart from those of its shape and material.
            complaints += [f"{table['file']} {table['table']} {table['variant']}: {line}" for line in strange]
        for table in tables:
            for key in table["keys"]:
                if not key["help"]:
                    complaints.append(f"{table['file']} {table['table']}: {key['name']} has no help")
    print("\n".join(complaints) or f"{sum(len(t['keys']) for t in tables)} keys in {len(tables)} tables")
    sys.exit(1 if complaints else 0)


main()
