#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The reference of readout flags: docs/reference/readout-flags.md holds what `obscura sensor flags` tells, and a frame's card has these bits.
Usage: flag_reference_test.py OBSCURA SOURCE-DIRECTORY [--update]"""
import json
import pathlib
import subprocess
import sys
import tempfile
import tomllib

obscura, source = sys.argv[1], pathlib.Path(sys.argv[2])
flags = json.loads(subprocess.run([obscura, "sensor", "flags", "--json"], capture_output=True, text=True, check=True).stdout)
text = "\n".join(["# Readout flags", "", "Generated from `obscura sensor flags`; do not edit. The flags of window nn of a frame are the sum of these values: in the card",
                  "`Wnn_FLAG` of FITS, PNG and raw files, and in the chunks and truth of frames. What they say of a readout is in [sensors](../sensors.md#readout).", "",
                  "| bit | value | flag | meaning |", "| --- | --- | --- | --- |",
                  *[f"| {f['bit']} | {f['value']} | `{f['name']}` | {f['meaning']} |" for f in flags]]) + "\n"
page = source / "docs/reference/readout-flags.md"
if "--update" in sys.argv:
    page.write_text(text)
failed = not page.exists() or page.read_text() != text
if failed:
    print(f"{page} differs: run this test with --update")
# A frame of a clamped exposure has the value of the flag with that name.
with tempfile.TemporaryDirectory(prefix="obscura-flags-") as name:
    folder = pathlib.Path(name)
    (folder / "c.toml").write_text(f'[scene]\nfile = "{source.resolve()}/config/scenes/cornell.toml"\n[gige]\nenabled = false\n[camera]\nexposure_us = 1\n'
                                   '[sensor.readout]\nwidth = 64\nheight = 64\nshutter = "rolling"\n')
    done = subprocess.run([obscura, "capture", "c.toml", "--format", "raw", "-o", "out"], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        sys.exit(print(done.stderr) or 1)
    card = tomllib.loads(next((folder / "out").glob("*.toml")).read_text())["W00_FLAG"]
    wanted = {f["name"]: f["value"] for f in flags}["T_CLAMPED_UP"]
    if not card & wanted:
        print(f"W00_FLAG is {card} for an exposure below a row slot: T_CLAMPED_UP, {wanted}, is wanted")
        failed = True
sys.exit(failed)
