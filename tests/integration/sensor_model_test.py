#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Models of sensors: the shipped ones against numpy, by their formulas; new ones, pictures, mistakes; frames by configuration.
Usage: sensor_model_test.py OBSCURA OBSCURAD"""
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from checks import check, failures  # noqa: E402
from read_image import read_fits  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

obscura, obscurad = sys.argv[1:3]
temporary = tempfile.TemporaryDirectory(prefix="obscura-sensor-model-")
folder = pathlib.Path(temporary.name)


def call(*arguments, program=obscura):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, cwd=folder)
    return done.returncode, done.stdout, done.stderr


def lin_log(charge, knee, fold):
    return np.where(charge < knee, charge, knee + fold * np.log1p(np.maximum(0, charge - knee) / fold))


def dual_gain(signal, switch_dn, ratio):
    return np.where(signal < switch_dn, signal, switch_dn + (signal - switch_dn) / ratio)


# Model, parameters, argument of eval, member of its answer, formula.
SENSORS = [("lin-log", {"knee": 30000, "fold": 7000}, "charge", "collect_e", lin_log),
           ("dual-gain", {"switch_dn": 2000, "ratio": 6}, "signal", "convert_dn", dual_gain)]

names = [entry["name"] for entry in json.loads(call("model", "list", "--json")[1]) if entry["kind"] == "sensor"]
check("each shipped sensor is tested", sorted(names) == sorted(s[0] for s in SENSORS), names)
for name, parameters, argument, member, formula in SENSORS:
    settings = [word for key, value in parameters.items() for word in ("--set", f"{key}={value}")]
    worst = 0
    for value in (0, 1, 1234.5, 2000, 2000.5, 29999, 30000, 30001, 45000, 123456, 2e6):
        told = json.loads(call("model", "eval", name, *settings, "--at", f"{argument}={value}", "--at", "x=7", "--json")[1])
        worst = max(worst, abs(told[member] / formula(value, **parameters) - 1) if value else abs(told[member]))
    check(f"{name} is what numpy makes of its formula", worst < 1e-12, worst)
    status, said, error = call("model", "check", name)
    check(f"{name} is sound", status == 0 and ": sound: " in said and "warning" not in said, said + error)

# The table of a plot, against moments of a normal distribution.
call("model", "plot", "lin-log", "-o", "pixel.csv")
rows = [{key: float(text) for key, text in row.items()} for row in csv.DictReader((folder / "pixel.csv").open())]
z = np.linspace(-7, 7, 4001)
weight = np.exp(-z * z / 2) / np.sum(np.exp(-z * z / 2))
difference = 0
for row in rows[::10]:
    kept = lin_log(np.maximum(0, row["mean_e"] + z * math.sqrt(row["mean_e"])), 40000, 12000)
    mean = np.sum(weight * kept)
    difference = max(difference, abs(row["kept_e"] / mean - 1), abs(row["kept_variance_e2"] / np.sum(weight * (kept - mean) ** 2) - 1))
check("its table has mean and variance behind the pixel", len(rows) == 201 and difference < 1e-3, difference)
above = rows[-1]
slope = 1 / (1 + (above["mean_e"] - 40000) / 12000)
check("beyond the knee the variance is that of the slope", abs(above["kept_variance_e2"] / (slope ** 2 * above["mean_e"]) - 1) < 0.01, above)

status, said, error = call("model", "new", "sensor", "pixel")
check("a new sensor is written", (status, said) == (0, "pixel.sns\n"), error)
status, said, error = call("model", "check", "pixel.sns")
check("it is sound", status == 0 and said.startswith("pixel.sns: sound: ") and "warning" not in said, said + error)
shown = json.loads(call("model", "show", "pixel.sns", "--json")[1])
check("what it costs is shown", shown["kind"] == "sensor" and shown["collect_operations"] == shown["operations"] > 0, shown)
for form, begins in (("svg", b"<svg"), ("csv", b"mean_e,")):
    status, _, error = call("model", "plot", "pixel.sns", "-o", f"pixel.{form}")
    check(f"it is drawn as {form}", status == 0 and (folder / f"pixel.{form}").read_bytes().startswith(begins), error)
xml.etree.ElementTree.parse(folder / "pixel.svg")
timed = json.loads(call("model", "bench", "pixel.sns", "--json")[1])
check("times are measured", timed["model_ns"] > 0 and set(timed["built_in_ns"]) == {"collect", "shot_noise"}, timed)


def model(name, text):
    (folder / name).write_text(text)
    return call("model", "check", name)


signature = "(scalar q, scalar x, scalar y)"
status, said, _ = model("none.sns", "parameter a 1;\n")
check("a file without functions is refused", status == 78 and "one of scalar light(scalar mean, scalar x, scalar y), scalar collect(" in said, said)
status, said, _ = model("bad.sns", f"parameter a 2;\nscalar collect{signature} {{ return sqrt(6e4 - q) * a; }}\n")
check("one that is not finite is refused with its place", status == 78 and said.startswith("bad.sns:2:8: collect() is not finite for 600") and said.endswith("in pixel (0, 0)\n"), said)
status, said, _ = model("fall.sns", f"scalar collect{signature} {{ return q < 7e4 ? 1.01 * q : 7e4 - 0.1 * (q - 7e4) + x / 1000; }}\n")
lines = said.splitlines()
check("charge from nothing, and a fall, are told with their places", status == 0 and len(lines) == 3
      and lines[0].startswith("fall.sns:1:8: warning: collect() gives more charge than comes in for 69")
      and lines[1].startswith("fall.sns:1:8: warning: collect() falls from 70") and "for 200000 e- in pixel (0, 0)" in lines[1], said)

(folder / "scene.toml").write_text("""[camera]
width = 96
height = 96
pixel_pitch_um = 10
focal_length_mm = 50
aperture_mm = 10
position_m = [100, 0, 0]
look_at_m = [0, 0, 0]
up = [0, 0, 1]
[sun]
direction = [1, 0.2, 0.3]
[[body]]
shape = "ellipsoid"
radii_m = [0.8, 0.8, 0.8]
albedo = 0.5
""")
noisy = f"""parameter gain 1;   //! , 0..2, Factor
parameter tilt 0;   //! deg, 0..90, An angle
scalar light{signature} {{ return q * gain * (1 + 0.001 * x); }}
scalar collect{signature} {{ return 50000 * (1 - exp(-q / 50000)) * (1 + 0.01 * normal(0)); }}
scalar convert{signature} {{ return q + 2 * normal(1) + sin(0.1 * y + tilt); }}
"""
(folder / "noisy.sns").write_text(noisy)


def configuration(sensor, more=""):
    (folder / "c.toml").write_text(f"""[scene]
file = "scene.toml"
[daemon]
seed = 5
run = 0
[camera]
exposure_us = 20000
[gige]
enabled = false
{more}
[sensor]
{sensor}
[sensor.readout]
width = 96
height = 96
""")
    return "c.toml"


def frames(name, sensor, more="", *options):
    status, _, error = call("capture", configuration(sensor, more), "-n", 2, "-o", name, "--format", "fits", "--no-preview", *options)
    files = sorted((folder / name).glob("frame_*.fits")) if status == 0 else []
    check(f"{name} is captured", status == 0 and len(files) == 2, error)
    return [read_fits(file.read_bytes())[0] for file in files]


bytes_with = {}
for threads in (1, 2, 7):
    for native in ("auto", "off"):
        bytes_with[threads, native] = frames(f"noisy-{threads}-{native}", 'model = { model = "noisy.sns", gain = 0.7, tilt_deg = 30 }',
                                             f'[models]\nnative = "{native}"\n[render]\nthreads = {threads}')
check("threads and machine code do not change a byte", all(given == bytes_with[1, "auto"] for given in bytes_with.values()))
plain = frames("plain", 'name = "plain"')
check("the model changes the picture", plain != bytes_with[1, "auto"])
check("a knee beyond the light changes nothing", frames("high", 'model = { model = "lin-log", knee = 1e7 }') == frames("unclipped", 'model = { model = "lin-log", knee = 9e6 }'))

(folder / "chip.toml").write_text('name = "chip"\nmodel = { model = "noisy.sns", gain = 0.7, tilt_deg = 30 }\n')
check("a sensor file names a model beside itself", frames("filed", 'file = "chip.toml"') == bytes_with[1, "auto"])


def refused(what, sensor, words, more=""):
    status, said, error = call("check", configuration(sensor, more))
    check(what, status == 78 and all(word in error + said for word in words), said + error)


refused("an unknown parameter has a suggestion", 'model = { model = "noisy.sns", gian = 1 }', ["c.toml:12:32: sensor.model.gian: unknown key, did you mean \"gain\"?"])
refused("a value out of range", 'model = { model = "noisy.sns", gain = 3 }', ["sensor.model.gain: 3 is out of range, allowed 0 to 2"])
refused("a model of another kind", 'model = { model = "' + str(folder / "m.psf") + '" }', ["m.psf", "a psf model"] if (folder / "m.psf").write_text("scalar density(vec2 p, scalar wavelength) { return 1; }") else [])
refused("a word in place of the table", 'model = "lin-log"', ["allowed is a table: write model = { model = \"FILE.sns\" }"])
refused("a model that is not finite", 'model = { model = "bad.sns" }', ["bad.sns:2:8: collect() is not finite for 600"])
refused("one that costs too much", 'model = { model = "noisy.sns" }', ["models.max_ns_per_evaluation"], "[models]\nmax_ns_per_evaluation = 0.001")
refused("a non-linearity beside it", 'model = { model = "lin-log" }\n[sensor.detector]\nnonlinearity_1 = 0.01\n', ["set nonlinearity_1 to nonlinearity_4 to 0"])
status, said, error = call("check", configuration('model = { model = "fall.sns" }'))
check("a check tells what its author should know", status == 0 and "collect() falls from 70" in said + error, said + error)

(folder / "falling.toml").write_text('name = "falling"\nmodel = { model = "fall.sns" }\n')
status, said, error = call("check", "falling.toml", "--strict")
check("and of a sensor file", status == 1 and "obscura check: warning: sensor: " in error and "collect() falls from 70" in error, said + error)

status, printed, error = call("--config", configuration('model = { model = "noisy.sns", gain = 0.7, tilt_deg = 30 }'), "--print-config", program=obscurad)
line = next((line for line in printed.splitlines() if line.startswith("model = {")), "")
check("the effective configuration has it", status == 0 and line == f'model = {{ model = "{folder.resolve()}/noisy.sns", gain = 0.7, tilt_deg = 30.0 }}', line + error)
(folder / "printed.toml").write_text(printed)
status, again, error = call("--config", "printed.toml", "--print-config", program=obscurad)
check("and is read back", again.splitlines()[1:] == printed.splitlines()[1:], error)

daemon_folder = folder / "daemon"
daemon_folder.mkdir()
(daemon_folder / "noisy.sns").write_text(noisy)
daemon = SmallDaemon(daemon_folder, obscurad, pathlib.Path(__file__).resolve().parents[2], tables='[sensor]\nmodel = { model = "noisy.sns", gain = 1.5 }\n[daemon]\nrun = 3\n')
process = daemon.start()
deadline = time.monotonic() + 60
while not (folder / "daemon/frames/frame_000004.raw").exists() and time.monotonic() < deadline:
    time.sleep(0.1)
process.terminate()
process.wait(60)
call("capture", daemon.config, "-n", 3, "-o", "captured", "--format", "raw", "--no-preview")
both = [[(place / f"frame_{k:06}.raw").read_bytes() for k in (1, 2, 3)] for place in (folder / "daemon/frames", folder / "captured")]
check("a daemon has the frames of a capture", both[0] == both[1] and len(set(both[0])) == 3)

sys.exit(1 if failures else 0)
