#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Times of a readout in SuMoL: the shipped models against numpy, by their formulas; pictures of scenes and of sensors that
scan; a rolling shutter beside the built-in one; the truth table; mistakes. Usage: timing_model_test.py OBSCURA OBSCURAD"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cases"))
from checks import check, failures  # noqa: E402
from case_files import read_fits  # noqa: E402

obscura, obscurad = sys.argv[1:3]


def call(*arguments, folder):
    done = subprocess.run([obscura, *map(str, arguments)], capture_output=True, text=True, cwd=folder)
    return done.returncode, done.stdout, done.stderr


def ok(*arguments, folder):
    status, out, err = call(*arguments, folder=folder)
    check(" ".join(map(str, arguments[:3])) + " ends well", status == 0, err)
    return out


# By the formulas, in units of 1 us.
def interleaved(rows, line_us, gap_us):
    """Fields: rows 1, 3, 5, ... of the picture, then 2, 4, ..., counted from 1."""
    order = [*range(0, rows, 2), *range(1, rows, 2)]
    first_field = (rows + 1) // 2
    begin = np.empty(rows)
    for place, row in enumerate(order):
        begin[row] = place * line_us + (gap_us if place >= first_field else 0)
    return begin


def sequential(rows, columns, pixel_us, retrace_us, both_ways):
    begin = np.arange(rows * columns, dtype=float).reshape(rows, columns) * pixel_us
    begin += np.arange(rows)[:, None] * retrace_us
    if both_ways:
        begin[1::2] = begin[1::2, ::-1]
    return begin


def table(folder, *arguments):
    ok("model", "plot", *arguments, "-o", "out.csv", folder=folder)
    return [{key: int(value) for key, value in row.items()} for row in csv.DictReader((folder / "out.csv").open())]


def test_shipped(folder):
    names = [e["name"] for e in json.loads(ok("model", "list", "--json", folder=folder)) if e["kind"] == "timing"]
    check("each shipped model is tested", sorted(names) == ["line-interleaved", "pixel-sequential"], names)
    rows = table(folder, "line-interleaved", "--set", "line_us=31.5", "--set", "field_gap_us=1600")
    begin = np.rint(interleaved(576, 31.5, 1600) * 1000).astype(int)
    check("interleaved rows begin", [r["reset_ns"] for r in rows] == begin.tolist())
    check("interleaved rows end", [r["read_ns"] for r in rows] == (begin + 10_000_000).tolist())
    slots = np.array([r["release_ns"] for r in rows])
    check("rows leave in order, each after its read",
          (np.diff(slots) >= 0).all() and len({s - m for s, m in zip(slots, np.maximum.accumulate(begin))}) == 1)
    for both_ways in (0, 1):
        pixels = table(folder, "pixel-sequential", "--set", "pixel_us=0.7", "--set", "retrace_us=20", "--set", f"both_ways={both_ways}")
        begin = np.rint(sequential(512, 512, 0.7, 20, both_ways) * 1000).astype(int)
        check("pixels begin", [p["reset_ns"] for p in pixels] == begin.ravel().tolist(), both_ways)
        check("a row leaves with its last pixel",
              [p["release_ns"] for p in pixels[::512]] == (begin.max(axis=1) + 1000).tolist(), both_ways)
    for name in names:
        shown = json.loads(ok("model", "show", name, "--json", folder=folder))
        check(f"{name} has machine code where there is any", shown["native"] or "operation" not in json.dumps(shown), shown)
        check(f"{name} is sound", "sound: " in ok("model", "check", name, folder=folder))
        check(f"{name} is measured", "ns a sample" in ok("model", "bench", name, folder=folder))
        for ending in ("svg", "png"):
            ok("model", "plot", name, "-o", f"{name}.{ending}", folder=folder)
            check(f"{name}.{ending} is there", (folder / f"{name}.{ending}").stat().st_size > 1000)
    out = ok("model", "eval", "pixel-sequential", "--at", "row=3", "--at", "column=5", "--at", "exposure=2e-6", folder=folder)
    check("a pixel is told", f"{(3 * 512 + 5) * 1000} ns" in out and f"{(3 * 512 + 5) * 1000 + 2000} ns" in out, out)


SCENE = """[sun]
position_m = [-1.5e11, 0, 0]
[stars]
catalogue = "stars.csv"
[camera]
width = 64
height = 48
pixel_pitch_um = 10
focal_length_mm = 100
aperture_mm = 25
position_m = [0, 0, 0]
boresight = [1, 0, 0]
up = [0, 0, 1]
psf_sigma_px = 0.8
vibration = { model = "turn.mot" }
"""
TURN = """parameter across 4e-3;
parameter down 1.5e-3;
vec3 rotation(scalar t) { return vec3(down * t, across * t, 0); }
"""


def centroid(image):
    y, x = np.indices(image.shape)
    return (image * x).sum() / image.sum(), (image * y).sum() / image.sum()


def crossing(rows, columns, dt, late_s):
    """Where a star that is in the middle at t = 0, and runs left and down, meets the pixels: 10,000 px a radian."""
    cx, cy, v, w = (columns - 1) / 2, (rows - 1) / 2, 40.0, 15.0
    # x = cx - v (t + late), y = cy + w (t + late), t = (y columns + x) dt.
    t = (dt * (columns * (cy + w * late_s) + cx - v * late_s)) / (1 + dt * v - dt * columns * w)
    return cx - v * (t + late_s), cy + w * (t + late_s)


def test_scene(folder):
    shutter = 'shutter = { model = "pixel-sequential", pixel_us = 50 }\n'
    (folder / "scan.toml").write_text(SCENE + shutter)
    images = []
    for threads in (1, 2, 7):
        ok("render", "scan.toml", "-o", "scan.fits", "--layers", "--threads", threads, "--exposure", "0.001",
           "--truth-table", "scan.csv", folder=folder)
        images.append(read_fits(folder / "scan.fits")[1])
    check("a scanned picture does not depend on threads", all((i[""] == images[0][""]).all() for i in images[1:]))
    begin = sequential(48, 64, 50, 0, 0) * 1e-6
    times = next(v for k, v in images[0].items() if k.lower() == "time_s")
    check("the plane time_s has the middles of the exposures", np.abs(times - begin).max() < 1e-7, np.abs(times - begin).max())
    x, y = centroid(images[0][""].reshape(48, 64))
    # The trigger is half of the exposure before the time of the picture.
    want = crossing(48, 64, 50e-6, 0)
    check("the star is where its time says", np.hypot(x - want[0], y - want[1]) < 0.01, (x, y, want))
    star = [r for r in csv.DictReader((folder / "scan.csv").open()) if r["kind"] == "star"]
    check("the truth table has it there", len(star) == 1 and
          np.hypot(float(star[0]["x_px"]) - want[0], float(star[0]["y_px"]) - want[1]) < 0.003, (star, want))
    (folder / "rows.toml").write_text(SCENE + 'shutter = { model = "line-interleaved", line_us = 400 }\n')
    ok("render", "rows.toml", "-o", "rows.fits", "--layers", folder=folder)
    times = next(v for k, v in read_fits(folder / "rows.fits")[1].items() if k.lower() == "time_s")
    check("times of rows", np.abs(times - interleaved(48, 400, 0)[:, None] * 1e-6).max() < 1e-7)


SENSOR = """[scene]
file = "plain.toml"
[trigger]
source = "timer"
rate_hz = 2
[camera]
exposure_us = {exposure_us}
[models]
native = "{native}"
[render]
threads = {threads}
[sensor]
pixel_pitch_um = 10
[sensor.readout]
width = 64
height = 48
shutter = {shutter}
pixel_clock_hz = 8e6
row_overhead_ns = 2000
{readout}
[sensor.detector]
quantum_efficiency = [[400, 0.5], [900, 0.5]]
full_well_e = 50000
dark_current_e_per_s = 0
gain_dn_per_e = 0.05
adc_bits = 12
"""


def captured(folder, shutter, *more, exposure_us=998, native="auto", threads=1, readout=""):
    (folder / "c.toml").write_text(SENSOR.format(shutter=shutter, exposure_us=exposure_us, native=native, threads=threads,
                                                 readout=readout))
    ok("capture", "c.toml", "-n", 2, "--run", 7, "-o", "out", "--format", "fits", *more, folder=folder)
    return [read_fits(f)[1][""] for f in sorted((folder / "out").glob("*[0-9].fits")) if not f.name.startswith("truth")]


def test_sensor(folder):
    (folder / "plain.toml").write_text(SCENE)
    # A row takes 2 us + 64 pixels of 125 ns = 10 us; sample and reset are 200 ns apart.
    (folder / "rolling.tim").write_text("""parameter line_us 10;
scalar reset(scalar row, scalar exposure) { return row * line_us * 1e-6; }
scalar read(scalar row, scalar exposure) { return reset(row, exposure) + exposure; }
""")
    built_in = captured(folder, '"rolling"', exposure_us=999.8)
    own = captured(folder, '{ model = "rolling.tim" }', exposure_us=999.8)
    check("a rolling shutter as a model makes the frames of the built-in one",
          all((a == b).all() for a, b in zip(built_in, own)) and len(own) == 2)
    check("and not those of a global one", any((a != b).any() for a, b in zip(captured(folder, '"global"', exposure_us=999.8), own)))
    scan = '{ model = "pixel-sequential", pixel_us = 50 }'
    frames = captured(folder, scan, "--truth", "--exr", "--truth-table", "truth.csv")
    for threads in (2, 7):
        check("a scanned frame does not depend on threads",
              all((a == b).all() for a, b in zip(captured(folder, scan, threads=threads), frames)))
    check("nor on machine code", all((a == b).all() for a, b in zip(captured(folder, scan, native="off"), frames)))
    truth = read_fits(sorted((folder / "out").glob("truth_*.fits"))[0])[1]
    times = truth["TIME"]
    begin = sequential(48, 64, 50, 0, 0) * 1000
    check("the image TIME has the middles of the exposures",
          (times - times[0, 0] == begin - begin[0, 0]).all() and times.shape == (48, 64))
    x, y = centroid(truth[""].reshape(48, 64))
    # Frame 1 begins at scene time 0, its exposure of 998 us before the middles.
    trigger_s = (times[0, 0] - 499000) * 1e-9
    want = crossing(48, 64, 50e-6, trigger_s + 499e-6)
    check("the star is where its time says", np.hypot(x - want[0], y - want[1]) < 0.01, (x, y, want))
    star = [r for r in csv.DictReader((folder / "truth.csv").open()) if r["kind"] == "star"]
    check("the truth table has it there",
          np.hypot(float(star[0]["x_px"]) - want[0], float(star[0]["y_px"]) - want[1]) < 0.003, (star[0], want))
    # Exposures of pixels, by their columns.
    (folder / "ramp.tim").write_text("""scalar reset(scalar row, scalar column, scalar exposure) { return 0; }
scalar read(scalar row, scalar column, scalar exposure) { return exposure * (0.5 + column / columns); }
""")
    flat = SCENE.replace('vibration = { model = "turn.mot" }\n', "").replace('[stars]\ncatalogue = "stars.csv"\n', "")
    (folder / "plain.toml").write_text(flat + """[[body]]
name = "wall"
shape = "ellipsoid"
radii_m = [1000, 1000, 1000]
position_m = [3000, 0, 0]
albedo = 0.1
""")
    captured(folder, '{ model = "ramp.tim" }', "--truth", exposure_us=100)
    ramp = read_fits(sorted((folder / "out").glob("truth_*.fits"))[0])[1][""].reshape(48, 64)
    captured(folder, '"global"', "--truth", exposure_us=100)
    level = read_fits(sorted((folder / "out").glob("truth_*.fits"))[0])[1][""].reshape(48, 64)
    share = (ramp / level).mean(axis=0) - (0.5 + np.arange(64) / 64)
    check("light is collected for the exposure of each pixel", np.abs(share).max() < 0.01, np.abs(share).max())


def test_configuration(folder):
    (folder / "plain.toml").write_text(SCENE)
    text = SENSOR.format(shutter='{ model = "pixel-sequential", pixel_us = 50 }', exposure_us=100, native="auto", threads=1, readout="")
    (folder / "c.toml").write_text(text)
    printed = subprocess.run([obscurad, "--config", "c.toml", "--print-config"], capture_output=True, text=True, cwd=folder)
    line = [l for l in printed.stdout.splitlines() if l.startswith("shutter = ")]
    check("the configuration is printed with the table", len(line) == 1 and "pixel_us = 50" in line[0], line)
    (folder / "again.toml").write_text(printed.stdout)
    again = subprocess.run([obscurad, "--config", "again.toml", "--print-config"], capture_output=True, text=True, cwd=folder)
    check("and can be read again", [l for l in again.stdout.splitlines() if l.startswith("shutter = ")] == line, again.stderr)
    for shutter, what in [('{ model = "pixel-sequential", pixl_us = 50 }', 'did you mean "pixel_us"'),
                          ('{ model = "pixel-sequential", pixel_us = 0 }', "sensor.readout.shutter.pixel_us: 0"),
                          ('{ model = "pixel-sequentia" }', "pixel-sequential"), ('"model"', "write shutter = { model"),
                          ('{ model = "bad.tim" }', "bad.tim:2:8: read() is 0.1 s at row 0, and reset() is 0.5 s")]:
        (folder / "bad.tim").write_text("scalar reset(scalar row, scalar exposure) { return 0.5; }\n"
                                        "scalar read(scalar row, scalar exposure) { return 0.1; }\n")
        (folder / "c.toml").write_text(SENSOR.format(shutter=shutter, exposure_us=100, native="auto", threads=1, readout=""))
        status, _, err = call("capture", "c.toml", "-o", "out", folder=folder)
        check(f"refused: {shutter}", status == 78 and what in err, err)
    # A frame of 64 x 48 pixels, 1 ms each, takes 3 s; a trigger comes twice a second.
    (folder / "c.toml").write_text(SENSOR.format(shutter='{ model = "pixel-sequential", pixel_us = 1000 }', exposure_us=100,
                                                 native="auto", threads=1, readout=""))
    _, out, err = call("check", "c.toml", folder=folder)
    check("a frame longer than the time between triggers is told", "trigger" in out + err and "3" in out + err, out + err)


with tempfile.TemporaryDirectory(prefix="obscura-timing-") as temporary:
    folder = pathlib.Path(temporary)
    (folder / "stars.csv").write_text("ra_deg,dec_deg,v_mag\n0,0,1\n")
    (folder / "turn.mot").write_text(TURN)
    test_shipped(folder)
    test_scene(folder)
    test_sensor(folder)
    test_configuration(folder)
sys.exit(1 if failures else 0)
