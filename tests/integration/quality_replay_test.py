#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A run that degrades frames is made again, byte for byte, from the levels of its timing file; each degraded frame is
flagged, listed and says why.

Usage: quality_replay_test.py OBSCURAD OBSCURA
Exit status 1 if a check failed, 77 on a machine that is too busy.
"""
import csv
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SUPPORT = pathlib.Path(__file__).resolve().parents[1] / "support"
obscurad, obscura = sys.argv[1:3]
failures = []
PATIENCE_S = 120
FRAMES = 12
DEGRADED = 64  # of the frame flags
SIZE = 192


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def pixels(folder, number):
    return (folder / f"frame_{number:06}.raw").read_bytes()[:2 * SIZE * SIZE]


with tempfile.TemporaryDirectory(prefix="obscura-replay-") as temporary:
    folder = pathlib.Path(temporary)
    shutil.copy(SUPPORT / "light_scene.toml", folder / "scene.toml")
    # Image lag: each frame depends on the light of the one before.
    (folder / "obscurad.toml").write_text(f"""[scene]
file = "scene.toml"
[render]
samples_per_pixel = 256
threads = 1
[trigger]
source = "timer"
rate_hz = 2
over_trigger = "latch"
[deadline]
quality = "adapt"
[camera]
exposure_us = 200
[gige]
enabled = false
[file]
enabled = true
format = "raw"
directory = "frames"
queue_frames = 64
[daemon]
run = 0
pool_frames = 64
[sensor]
pixel_pitch_um = 10
[sensor.readout]
width = {SIZE}
height = {SIZE}
shutter = "global"
[sensor.detector]
lag = 0.02
""")
    with open(folder / "log", "w+", encoding="utf-8") as log:
        daemon = subprocess.Popen([obscurad, "--config", folder / "obscurad.toml", "--timing", folder / "run.csv"],
                                  stdout=subprocess.DEVNULL, stderr=log)
        end = time.monotonic() + PATIENCE_S
        while len(list((folder / "frames").glob("*.toml"))) < FRAMES and time.monotonic() < end and daemon.poll() is None:
            time.sleep(0.05)
        daemon.send_signal(signal.SIGTERM)
        check("the daemon ends well", daemon.wait(PATIENCE_S) == 0, (folder / "log").read_text())
    rows = [r for r in csv.DictReader((folder / "run.csv").read_text().splitlines()) if int(r["frame_id"]) <= FRAMES]
    check("there are that many frames", [int(r["frame_id"]) for r in rows] == list(range(1, FRAMES + 1)), rows)
    degraded = [r for r in rows if int(r["rows_degraded"]) > 0]
    check("some are degraded", len(degraded) > 0)
    check("those and no others are flagged", all((int(r["flags"]) & DEGRADED != 0) == (r in degraded) for r in rows))
    check("those and no others have reasons", all((r["quality_reasons"] != "0") == (r in degraded) for r in rows))
    check("each has its error", all(int(r["error_ppm"]) > 0 and int(r["error_worst_ppm"]) >= int(r["error_ppm"]) for r in degraded))

    if any(set(r["levels"]) & {"7", "8"} for r in rows):
        print("skipped: a machine so busy that rows were made from an earlier frame, which no levels give again")
        sys.exit(77)
    replay = [obscura, "capture", folder / "obscurad.toml", "--format", "raw", "--no-preview", "--levels", folder / "run.csv"]
    subprocess.run([*replay, "-n", str(FRAMES), "-o", folder / "again"], check=True, stdout=subprocess.DEVNULL)
    check("the levels give the same bytes", all(pixels(folder / "frames", n) == pixels(folder / "again", n) for n in range(1, FRAMES + 1)),
          [n for n in range(1, FRAMES + 1) if pixels(folder / "frames", n) != pixels(folder / "again", n)])
    subprocess.run([*replay, "-n", "2", "--first", "6", "-o", folder / "part"], check=True, stdout=subprocess.DEVNULL)
    check("from any frame on", all(pixels(folder / "frames", n) == pixels(folder / "part", n) for n in (6, 7)))
    subprocess.run([*replay[:-2], "-n", str(FRAMES), "-o", folder / "full"], check=True, stdout=subprocess.DEVNULL)
    different = [n for n in range(1, FRAMES + 1) if pixels(folder / "frames", n) != pixels(folder / "full", n)]
    first = min(int(r["frame_id"]) for r in degraded)
    check("full frames are others from the first degraded one on", different and min(different) == first, (different, first))

    report = subprocess.run([obscura, "timing", folder / "run.csv", "--degraded"], check=True, capture_output=True, text=True).stdout
    listed = report.partition("Each degraded frame\n")[2].splitlines()[1:]
    known = {int(line.split()[0]) for line in listed if line.strip() and line.split()[0].isdigit()}
    check("the report explains each", {int(r["frame_id"]) for r in degraded} <= known and "not stated" not in report, report)

sys.exit(1 if failures else 0)
