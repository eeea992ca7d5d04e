#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A run that degrades frames is made again, byte for byte, from the levels of its timing file; each degraded frame is
flagged, listed and says why.

Usage: quality_replay_test.py OBSCURAD OBSCURA
Exit status 1 if a check failed.
"""
import csv
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402

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
        daemon = Child([obscurad, "--config", folder / "obscurad.toml", "--timing", folder / "run.csv"],
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

    replay = [obscura, "capture", folder / "obscurad.toml", "--format", "raw", "--no-preview", "--levels", folder / "run.csv"]
    subprocess.run([*replay, "-n", str(FRAMES), "-o", folder / "again"], check=True, stdout=subprocess.DEVNULL)
    check("the levels give the same bytes", all(pixels(folder / "frames", n) == pixels(folder / "again", n) for n in range(1, FRAMES + 1)),
          [n for n in range(1, FRAMES + 1) if pixels(folder / "frames", n) != pixels(folder / "again", n)])
    subprocess.run([*replay, "-n", "2", "--first", "6", "-o", folder / "part"], check=True, stdout=subprocess.DEVNULL)
    check("from any frame on", all(pixels(folder / "frames", n) == pixels(folder / "part", n) for n in (6, 7)))
    subprocess.run([*replay[:-2], "-n", str(FRAMES), "-o", folder / "full"], check=True, stdout=subprocess.DEVNULL)
    different = [n for n in range(1, FRAMES + 1) if pixels(folder / "frames", n) != pixels(folder / "full", n)]
    # A coarse level need not change a number, nor rows of an earlier frame where nothing moves.
    check("full frames are others, from the first degraded one on",
          different and min(different) >= min(int(r["frame_id"]) for r in degraded), (different, [r["levels"] for r in rows]))

    # Rows of earlier frames, which a run has on a machine that stalls.
    def with_levels(name, levels):
        lines = (folder / "run.csv").read_text().splitlines()
        titles = lines[0].split(",")
        fields = [line.split(",") for line in lines[1:]]
        for row in fields:
            if (own := levels.get(int(row[titles.index("frame_id")]))) is not None:
                row[titles.index("levels")] = own
        (folder / name).write_text("\n".join([lines[0], *(",".join(row) for row in fields)]) + "\n")
        return folder / name

    def capture(levels, output, *options, config="obscurad.toml"):
        subprocess.run([obscura, "capture", folder / config, "--format", "raw", "--no-preview", "--levels", levels, "-o", folder / output, *options],
                       check=True, stdout=subprocess.DEVNULL)
        return folder / output

    groups = SIZE // 16
    stalled = with_levels("stalled.csv", {4: "6" * groups, 5: "0" * 4 + "7" * (groups - 4), 6: "8" * groups, 7: "0" * groups})
    (folder / "two.toml").write_text((folder / "obscurad.toml").read_text().replace("threads = 1", "threads = 2"))
    one = capture(stalled, "one", "-n", "8")
    two = capture(stalled, "two", "-n", "8", config="two.toml")
    check("rows of earlier frames are the same on any threads", all(pixels(one, n) == pixels(two, n) for n in range(1, 9)))
    part = capture(stalled, "later", "-n", "2", "--first", "6")
    check("from any frame on", all(pixels(one, n) == pixels(part, n) for n in (6, 7)))
    check("they are those of the last whole one", pixels(one, 5) != pixels(folder / "full", 5))
    refused = subprocess.run([obscura, "capture", folder / "obscurad.toml", "--no-preview", "-o", folder / "refused", "--levels",
                              with_levels("first.csv", {1: "7" * groups})], capture_output=True, text=True)
    check("a file that begins with them is refused", refused.returncode != 0 and "frame 1: rows of an earlier frame" in refused.stderr, refused.stderr)

    report = subprocess.run([obscura, "timing", folder / "run.csv", "--degraded"], check=True, capture_output=True, text=True).stdout
    listed = report.partition("Each degraded frame\n")[2].splitlines()[1:]
    known = {int(line.split()[0]) for line in listed if line.strip() and line.split()[0].isdigit()}
    check("the report explains each", {int(r["frame_id"]) for r in degraded} <= known and "not stated" not in report, report)

sys.exit(1 if failures else 0)
