#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Ground truth of streamed frames: `obscura grab --chunks` saves what `obscura capture` states of the same frames, and
the reader in docs/gige.md finds the bodies.

Usage: chunks_test.py OBSCURA OBSCURAD SOURCE-DIRECTORY
Exit status 1 if a check failed.
"""
import csv
import json
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import tomllib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402

obscura, obscurad, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
failures = []
FRAMES = 3
ADDRESS = f"127.{90 + os.getpid() % 100}.{os.getpid() // 100 % 250}.{1 + os.getpid() % 250}"


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def run(arguments, folder):
    done = subprocess.run(arguments, cwd=folder, capture_output=True, text=True, timeout=120)
    check(" ".join(str(a) for a in arguments[:2]) + " succeeds", done.returncode == 0, done.stderr)
    return done.stdout


def same_cell(value, text):
    """A value of JSON and a cell of CSV."""
    if value is None:
        return text in ("", "inf")
    return value == text if isinstance(value, str) else math.isclose(value, float(text or "nan"), rel_tol=1e-9,
                                                                     abs_tol=6e-6)


with tempfile.TemporaryDirectory(prefix="obscura-chunks-") as name:
    folder = pathlib.Path(name)
    (folder / "scene.toml").write_text("""[sun]
direction = [-1, 0, 0.3]
distance_au = 1
[camera]
focal_length_mm = 50
aperture_mm = 25
psf_sigma_px = 0.5
distortion = "radial"
distortion_coefficients = [-0.1, 0.02]
position_m = [-20000, 30, -20]
boresight = [1, -0.001, 0.0015]
up = [0, 0, 1]
[[body]]
name = "rock"
shape = "ellipsoid"
radii_m = [120, 80, 40]
albedo = 0.3
spin_axis = [0, 0.2, 1]
spin_rate_deg_per_s = 30
[[landmark]]
name = "pole, north"
body = "rock"
latitude_deg = 90
longitude_deg = 0
""")
    (folder / "obscurad.toml").write_text(f"""[scene]
file = "scene.toml"
[daemon]
run = 5
seed = 3
[trigger]
source = "timer"
rate_hz = 5
[camera]
exposure_us = 2000
[[camera.window]]
width = 160
height = 100
exposure_us = 2000
[[camera.window]]
width = 60
height = 30
offset_x = 40
offset_y = 110
exposure_us = 1000
[gige]
interface = "{ADDRESS}"
packet_size = 8000
truth_entries = 60
[file]
enabled = true
directory = "filed"
format = "raw"
truth_table = true
[sensor.readout]
width = 160
height = 160
""")
    daemon = Child([obscurad, "--config", "obscurad.toml", "--ready-file", "ready"], cwd=folder,
                              stderr=subprocess.DEVNULL)
    try:
        for _ in range(600):
            if (folder / "ready").exists() or daemon.poll() is not None:
                break
            time.sleep(0.1)
        check("the daemon starts", (folder / "ready").exists())
        run([obscura, "grab", "-a", ADDRESS, "-n", str(FRAMES), "--format", "raw", "--chunks", "-o", "frames",
             "--timeout", "30"], folder)
        run([obscura, "grab", "-a", ADDRESS, "-n", str(FRAMES), "--format", "raw", "-o", "lens", "--intrinsics",
             "lens/camera.json", "--lens", "obscurad.toml", "--timeout", "30"], folder)
        run([obscura, "grab", "-a", ADDRESS, "-n", "1", "--intrinsics", "unsaved.json", "--timeout", "30"], folder)
        (folder / "other_scene.toml").write_text(
            (folder / "scene.toml").read_text().replace("focal_length_mm = 50", "focal_length_mm = 60"))
        (folder / "other.toml").write_text(
            (folder / "obscurad.toml").read_text().replace("scene.toml", "other_scene.toml"))
        wrong = subprocess.run([obscura, "grab", "-a", ADDRESS, "-n", "1", "--intrinsics", "wrong.json", "--lens",
                                "other.toml", "--timeout", "30"], cwd=folder, capture_output=True, text=True, timeout=120)
        check("another lens is refused", wrong.returncode == 66 and "no camera of the configuration has the frames' focal "
              "length" in wrong.stderr and not (folder / "wrong.json").exists(), (wrong.returncode, wrong.stderr))
        run([obscura, "grab", "-a", ADDRESS, "-n", "1", "--format", "fits", "--chunks", "-o", "fits", "--timeout", "30"],
            folder)
        run([obscura, "grab", "-a", ADDRESS, "-n", "1", "--format", "raw", "--no-preview", "-o", "plain", "--timeout",
             "30"], folder)

        def refused(what, words, *said):
            done = subprocess.run([obscura, "grab", "-a", ADDRESS, "-n", "1", "--timeout", "30", *words], cwd=folder,
                                  capture_output=True, text=True, timeout=120)
            check(f"{what} is refused in a line with what is allowed", done.returncode not in (0, 1) and
                  done.stderr.count("\n") == 1 and all(text in done.stderr for text in said), (done.returncode, done.stderr))

        refused("a gain that is too high", ["--gain-db", "99"], "Gain", "allowed 0 to ")
        refused("an exposure that is too short", ["--exposure-us", "0.001"], "ExposureTime", "allowed ", " us")
        refused("a pixel format that is misspelt", ["--pixel-format", "Mon12p"], "PixelFormat", 'did you mean "Mono12p"?')
        refused("a pixel format that is unknown", ["--pixel-format", "BayerRG8"], "PixelFormat", "Mono12", "Mono16")
        (folder / "full").mkdir()
        (folder / "full" / "chunks.jsonl").symlink_to("/dev/full")
        refused("a full disk", ["--chunks", "--format", "raw", "-o", "full"], "chunks.jsonl: cannot be written: No space left on device")
        # Saturated pixels, counted in the saved frames; at 12 bits the top is 4095.
        told = json.loads(run([obscura, "grab", "-a", ADDRESS, "-n", "2", "--format", "raw", "--no-preview", "-o", "bright",
                               "--gain-db", "24", "--json", "--timeout", "30"], folder))
        counts = [sum(value >= 4095 for value in memoryview(f.read_bytes()).cast("H")) for f in sorted((folder / "bright").glob("*.raw"))]
        check("saturated pixels are counted", len(counts) == 2 and sum(counts) > 0 and told["saturated_pixels"] == sum(counts) and
              told["most_saturated_pixels"] == max(counts), (counts, told))
    finally:
        daemon.send_signal(signal.SIGTERM)
        daemon.wait(60)
    run([obscura, "capture", "obscurad.toml", "-n", str(FRAMES), "--format", "raw", "-o", "captured", "--intrinsics",
         "captured/camera.json", "--truth-table", "captured/truth.csv"], folder)

    # The JSON file of received frames is that of captured ones, but for the clock.
    received, captured = (json.loads((folder / part / "camera.json").read_text()) for part in ("lens", "captured"))
    times = [[frame.pop("time_s") for frame in said["frames"]] for said in (received, captured)]
    check("as many frames", len(received["frames"]) == FRAMES, len(received["frames"]))
    wrong = [(key, received.get(key), captured[key]) for key in captured if received.get(key) != captured[key]]
    check("the JSON file for OpenCV is that of obscura capture", not wrong and received.keys() == captured.keys(), wrong)
    check("times of the poses", all(abs((b - a) - (d - c)) < 1e-3 for a, b, c, d in zip(times[0], times[0][1:], times[1],
                                                                                       times[1][1:])), times)
    unsaved = json.loads((folder / "unsaved.json").read_text())
    check("without --lens it has the matrix and the poses",
          unsaved["camera_matrix"] == captured["camera_matrix"] and "lens" not in unsaved and
          "distortion_coefficients" not in unsaved and "R" not in unsaved["frames"][0] and
          "file" not in unsaved["frames"][0] and unsaved["sensor"] == captured["sensor"], unsaved)

    lines = [json.loads(line) for line in (folder / "frames" / "chunks.jsonl").open()]
    check("one line per frame", len(lines) == FRAMES, len(lines))
    cards = []
    for frame in lines:
        number = frame["frame_id"]
        grabbed = tomllib.loads((folder / "frames" / frame["file"]).with_suffix(".toml").read_text())
        captured = tomllib.loads((folder / "captured" / f"frame_{number:06}.toml").read_text())
        cards.append(captured)
        same = (folder / "frames" / frame["file"]).read_bytes() == (folder / "captured" / frame["file"]).read_bytes()
        check(f"frame {number} has the captured pixels", same)
        keys = [k for k in captured if re.fullmatch(r"(W\d\d|CAM|SUN|B\d+)_\w+|BODY\d|[FC][XY]|[XY]PIXSZ|FOCALLEN|"
                                                    r"EXPOSURE|GAIN|SEED|RUN|WINDOWS|OFFSET[XY]", k)]
        check("captures state poses and windows", len(keys) > 40, keys)
        wrong = [k for k in keys if k not in grabbed or
                 (not math.isclose(grabbed[k], captured[k], rel_tol=1e-12, abs_tol=1e-15)
                  if isinstance(captured[k], float) else grabbed[k] != captured[k])]
        check(f"frame {number} has the captured cards", not wrong,
              [(k, grabbed.get(k), captured[k]) for k in wrong[:4]])
        check("camera in JSON", frame["camera"]["position_m"] == [captured[f"CAM_{a}"] for a in "XYZ"])
        check("attitude in JSON",
              frame["bodies"][0]["attitude"] == [captured[f"B0_Q{a}"] for a in "WXYZ"])
        check("names and windows in JSON", frame["bodies"][0]["name"] == "rock" and
              [w["image_y"] for w in frame["windows"]] == [0, 100] and frame["windows"][1]["x"] == 40)
        check("run and seed", (frame["run"], frame["seed"]) == (5, 3))
        rows = frame["rows"]
        check("a time for each row", len(rows) == frame["size"][1] == 130 and
              all(reset < read for reset, read in rows))
        check("exposures of the rows", abs(rows[0][1] - rows[0][0] - 2_000_000) < 200_000 and
              abs(rows[-1][1] - rows[-1][0] - 1_000_000) < 200_000, rows[-1])
        check("times by the camera's clock",
              frame["timestamp_ns"] <= rows[0][0] < frame["mid_exposure_ns"] < rows[-1][1])
        png = (folder / "frames" / f"preview_{number:06}.png").read_bytes()
        check("the preview of windows is in colour", png[25] == 2, png[25])
    # The truth table: of the chunk, of the daemon's file and of captures.
    tables = {place: list(csv.DictReader((folder / place / "truth.csv").open())) for place in ("captured", "filed")}
    table_only = ("latitude_deg", "longitude_deg", "diameter_m", "point_x_m", "point_y_m", "point_z_m")
    for frame in lines:
        of_frame = {place: [line for line in table if line["frame"] == str(frame["frame_id"])]
                    for place, table in tables.items()}
        entries = [line for line in of_frame["captured"] if line["kind"] not in ("pose", "rows")]
        check("the file of the daemon has the captured truth", len(of_frame["filed"]) == len(of_frame["captured"]) > 75 and
              not [(a, b) for a, b in zip(of_frame["filed"], of_frame["captured"])
                   if any(a[c] != b[c] for c in a if c != "time_ns")])
        chunk = frame["truth_table"]
        check("the chunk has as many entries as it has room for", len(chunk) == 60 and
              frame["truth_entries_left_out"] == len(entries) - 60, (len(chunk), len(entries)))
        wrong = [(key, told[key], line[key]) for told, line in zip(chunk, entries) for key in told
                 if key not in ("frame", "time_ns") and key not in table_only and not same_cell(told[key], line[key])]
        check("the entries are those of the capture", not wrong, wrong[:3])
        check("body, Sun and landmark come first", [e["name"] for e in chunk[:3]] == ["rock", "sun", "pole, north"] and
              chunk[2]["kind"] == "landmark", chunk[:3])
        check("times are by the camera's clock", chunk[0]["time_ns"] - frame["mid_exposure_ns"] ==
              int(entries[0]["time_ns"]) - int(of_frame["captured"][0]["time_ns"]), chunk[0])
    # Frames of the second grab, which follow in the same folder, find the table of their own run.
    second = sorted((folder / "filed").glob("run2_frame_*.raw"))[0]
    told = json.loads(run([obscura, "truth", second, "--json"], folder))
    check("a later acquisition has a table of its own", (folder / "filed" / "run2_truth.csv").exists() and
          len(told["entries"]) > 75 and {e["frame"] for e in told["entries"]} == {told["header"]["FRAMEID"]}, told["header"])
    check("the body turns", len({tuple(f["bodies"][0]["attitude"]) for f in lines}) == FRAMES)

    data = (folder / "fits" / "frame_000001.fits").read_bytes()
    header = {data[i:i + 8].decode().strip(): data[i + 10:i + 80].decode().split("/")[0].strip()
              for i in range(0, data.index(b"END     "), 80)}
    wrong = [k for k in ("CAM_X", "CAM_QW", "B0_QZ", "SUN_X", "FX", "W01_ROW", "RUN")
             if not math.isclose(float(header.get(k, "nan")), cards[0][k], rel_tol=1e-12, abs_tol=1e-15)]
    check("FITS cards hold the ground truth", not wrong, [(k, header.get(k), cards[0][k]) for k in wrong])
    check("the name of the body is a card", "rock" in header.get("BODY0", ""), header.get("BODY0"))

    files = sorted(p.name for p in (folder / "plain").iterdir())
    check("no previews and no chunks unless wanted", [pathlib.Path(f).suffix for f in files] == [".raw", ".toml"], files)
    check("chunks are off after the run", "CAM_X" not in (folder / "plain" / files[1]).read_text())

    # The reader of the documentation, with Python's standard library alone.
    page = (source / "docs" / "gige.md").read_text()
    reader = re.search(r"```python\n(.*?)```", page[page.index("chunks.jsonl"):], re.S).group(1)
    printed = run([sys.executable, "-I", "-c", reader], folder).splitlines()
    check("a line for each body", len(printed) == FRAMES, printed)
    for line, card in zip(printed, cards):
        # The direction to the body in the camera's axes, by a rotation matrix.
        w, x, y, z = (card[f"CAM_Q{a}"] for a in "WXYZ")
        matrix = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                  [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                  [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
        away = [card[f"B0_{a}"] - card[f"CAM_{a}"] for a in "XYZ"]
        u, v, depth = (sum(matrix[j][i] * away[j] for j in range(3)) for i in range(3))
        wanted = (card["CX"] + card["FX"] * u / depth, card["CY"] + card["FY"] * v / depth)
        got = [float(t) for t in re.search(r"rock column ([-\d.]+), row ([-\d.]+)$", line).groups()]
        check("the reader finds the body", math.dist(got, wanted) < 0.01, (got, wanted))

sys.exit(1 if failures else 0)
