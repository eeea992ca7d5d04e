#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What obscura check says of planets: ground, Sun and maps beside the samples of LOLA's LDEM_4 and arithmetic, common mistakes, and its cost beside that of obscura capture.
Usage: check_planet_test.py OBSCURA SOURCE. Skipped (77) without numpy or the data."""
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile

obscura, source = sys.argv[1:3]
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from checks import check, failures  # noqa: E402

data = pathlib.Path(os.environ.get("OBSCURA_DATA", f"{source}/../shared/data")) / "dem_moon_lola_ldem4"
if not (data / "LDEM_4.IMG").exists():
    sys.exit(print(f"skipped: {data}/LDEM_4.IMG is missing") or 77)
try:
    import numpy as np
except ImportError:
    sys.exit(print("skipped: python3-numpy is not installed") or 77)
folder = pathlib.Path(tempfile.mkdtemp(prefix="obscura-check-"))
RADIUS, AU = 1737400.0, 149597870700.0
NUMBERS = np.fromfile(data / "LDEM_4.IMG", "<i2").reshape(720, 1440)
LABEL = (data / "LDEM_4.LBL").read_bytes()


def near(what, value, truth, within):
    check(f"{what}: {value}, {truth} is right", value is not None and abs(value - truth) <= within)


def fits(name, values):
    """A FITS image without any word on its place, first row first."""
    cards = ["SIMPLE  =                    T", "BITPIX  =                  -32", "NAXIS   =                    2",
             f"NAXIS1  = {values.shape[1]:20d}", f"NAXIS2  = {values.shape[0]:20d}", "END"]
    head = "".join(f"{card:<80}" for card in cards).encode()
    body = values.astype(">f4").tobytes()
    (folder / name).write_bytes(head.ljust(2880) + body.ljust((len(body) + 2879) // 2880 * 2880, b"\0"))
    return name


def place(longitude, latitude, distance):
    lon, lat = np.radians([longitude, latitude])
    return distance * np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])


def scene(heights, camera, sun="position_m = [149597870700, 0, 0]", extra=""):
    tables = "\n".join(f"[[body.height]]\n{keys}" for keys in heights)
    down = (-camera / np.linalg.norm(camera)).tolist()
    (folder / "scene.toml").write_text(f"""name = "moon"
[sun]
{sun}
[camera]
width = 64
height = 64
pixel_pitch_um = 5.5
focal_length_mm = 10
aperture_mm = 5
position_m = {camera.tolist()}
boresight = {down}
up = [0, 0.1, 1]
[[body]]
name = "moon"
shape = "planet"
radii_m = [{RADIUS}, {RADIUS}, {RADIUS}]
material = "moon"
{tables}
{extra}
""")
    return folder / "scene.toml"


def run(*words):
    done = subprocess.run([obscura, *map(str, words)], capture_output=True, text=True)
    return done, [line for line in done.stderr.splitlines() if "%" not in line and "at work" not in line]


def checked(what, *arguments, **keywords):
    done, _ = run("check", "--json", "--quick", scene(*arguments, **keywords))
    check(f"{what}: status {done.returncode}", done.returncode == 0, done.stderr)
    return json.loads(done.stdout)["cameras"][0] if done.returncode == 0 else {"warnings": [], "bodies": [{}], "sun": {}}


def warned(what, camera, word, *texts):
    said = [w["text"] for w in camera["warnings"] if w["what"] == word]
    check(f"{what}: a warning {word} with {texts}", any(all(text in line for text in texts) for line in said), camera["warnings"])


for name in ("LDEM_4.LBL", "LDEM_4.IMG"):
    (folder / name).write_bytes((data / name).read_bytes())
LDEM = 'file = "LDEM_4.LBL"'
HIGH = place(20.125, -10.125, RADIUS + 100e3)  # above the middle of a pixel

# A sound scene: ground and Sun by numpy, the range and edges of the label.
sound = checked("sound", [LDEM], HIGH, sun=f"position_m = [{2 * AU}, 0, 0]")
row, column = int((90 + 10.125) * 4), int(20.125 * 4)
near("altitude, m", sound["bodies"][0]["altitude_m"], 100e3 - 0.5 * NUMBERS[row, column], 300)  # a pixel is 7.6 km: the cells of its tile are as wide
to_sun = np.array([2 * AU, 0, 0]) - HIGH
elevation = 90 - np.degrees(np.arccos(HIGH @ to_sun / np.linalg.norm(HIGH) / np.linalg.norm(to_sun)))
near("Sun above the horizon, deg", sound["bodies"][0]["sun_elevation_deg"], elevation, 0.01)
near("Sun's distance, au", sound["sun"]["distance_au"], np.linalg.norm(to_sun) / AU, 1e-6)
near("Sun's irradiance by ASTM E490 from 0.2 to 4 um, W/m2", sound["sun"]["irradiance_w_m2"], 1354.2 / 4, 0.2)
check("sound: nothing is odd about maps and Sun", not {w["what"] for w in sound["warnings"]} & {"map", "inside_sun", "sun_unit"}, sound["warnings"])
done, _ = run("check", "--quick", folder / "scene.toml")
for text in ("longitude 0 to 360 deg, latitude 90 to -90 deg", "1728521.5 to 1747904 m", "by the file's label", "2 au away", "below the camera", "above the horizon"):
    check(f"sound: {text}", text in done.stdout, done.stdout)

# The Sun in kilometres, and a body in the Sun.
warned("Sun in km", checked("Sun in km", [LDEM], HIGH, sun="position_m = [149597870.7, 0, 0]"), "inside_sun", "the camera is inside the Sun", "kilometres", "1 au")
warned("Sun of Jupiter in km", checked("Sun of Jupiter in km", [LDEM], HIGH, sun="position_m = [778500000, 0, 0]"), "sun_unit", "kilometres", "5.2")
ball = '[[body]]\nname = "ball"\nshape = "ellipsoid"\nradii_m = [10, 10, 10]\nmaterial = "lambert"\nalbedo = 0.1\nposition_m = [149597870700, 0, 0]'
warned("a body in the Sun", checked("a body in the Sun", [LDEM], HIGH, extra=ball), "inside_sun", '"ball" is inside the Sun')

# Bytes the other way round: by the label, in a file of reals.
(folder / "swapped.lbl").write_bytes(LABEL.replace(b"LSB_INTEGER", b"MSB_INTEGER"))
warned("swapped integers", checked("swapped integers", ['file = "swapped.lbl"'], HIGH), "map", "swapped.lbl", "bytes swapped", "16 bits")
whole = "projection = \"simple_cylindrical\""
swapped = (0.50123 * NUMBERS).astype("<f4").view("<u4").byteswap().view("<f4")
fits("swapped.fits", swapped)
done, said = run("check", "--quick", scene([f'file = "swapped.fits"\n{whole}\nleft_deg = 0\nright_deg = 360'], HIGH))
check("swapped reals: refused in a line", done.returncode == 66 and len(said) == 1 and all(text in said[0] for text in ("swapped.fits", "bytes swapped", "32 bits")), done.stderr)

# Longitudes: keys against the label, two maps against each other.
warned("keys against the label", checked("keys against the label", [f"{LDEM}\n{whole}"], HIGH), "map", "longitude -180 to 180", "longitude 0 to 360", "the keys hold")
fits("half.fits", 0.5 * NUMBERS.reshape(360, 2, 720, 2).mean(axis=(1, 3)))
warned("two maps", checked("two maps", [LDEM, f'file = "half.fits"\n{whole}'], HIGH), "map", "half.fits", "half a turn away", "left_deg")
check("two maps that fit", not any(w["what"] == "map" for w in checked("two maps that fit", [LDEM, f'file = "half.fits"\n{whole}\nleft_deg = 0\nright_deg = 360'], HIGH)["warnings"]))

# Scale and offset that were forgotten.
edges = f"{whole}\nleft_deg = 0\nright_deg = 360"
fits("km.fits", 0.5e-3 * NUMBERS)
warned("heights in km", checked("heights in km", [f'file = "km.fits"\n{edges}'], HIGH), "map", "km.fits", "scale_m = 1000")
fits("radius.fits", RADIUS + 0.5 * NUMBERS)
for what, keys, cure in (("radii as heights", 'file = "radius.fits"', 'values = "radius"'), ("heights as radii", f'file = "km.fits"\nvalues = "radius"\nscale_m = 1000', 'values = "height"')):
    done, said = run("check", "--quick", scene([f"{keys}\n{edges}"], HIGH))
    check(f"{what}: refused in a line", done.returncode == 66 and len(said) == 1 and cure in said[0], done.stderr)
done, _ = run("check", "--quick", scene([f'file = "half.fits"\n{edges}'], HIGH))
check("what was assumed is said", "assumed to be metres without offset" in done.stdout and "heights (assumed)" in done.stdout, done.stdout)

# A terrain whose tiles take seconds: judged by all rows, at a cost like that of capture.
near_ground = (pathlib.Path(source) / "config/scenes/moon.toml").read_text()
for key, value in (("width", "320"), ("height", "320"), ("position_m", "[-1573900, 908700, 0]"), ("boresight", "[0.433, -0.25, 0.8]"), ("up", "[-0.866, 0.5, 0]"), ("focal_length_mm", "3"), ("aperture_mm", "0.75")):
    near_ground = "\n".join(f"{key} = {value}" if line.startswith(f"{key} =") else line for line in near_ground.splitlines())
(folder / "near.toml").write_text(near_ground + "\n")
(folder / "camera.toml").write_text("""[scene]
file = "near.toml"
[gige]
enabled = false
[camera]
exposure_us = 500
[sensor]
pixel_pitch_um = 8.8
[sensor.readout]
width = 320
height = 320
shutter = "global"
""")


def cpu_s(*words):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done, _ = run(*words)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    check(f"{words[0]}: status {done.returncode}", done.returncode == 0, done.stderr)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done


capture_s, _ = cpu_s("capture", folder / "camera.toml", "-o", folder / "out")
check_s, done = cpu_s("check", "--json", folder / "camera.toml")
check(f"check takes {check_s:.1f} s of CPU, capture {capture_s:.1f} s", check_s < 3 * capture_s)
signal = json.loads(done.stdout)["cameras"][0]["signal"]
check("judged by all rows", signal["rows_share"] == 1, signal)
print(f"check {check_s:.2f} s, capture {capture_s:.2f} s of CPU")
sys.exit(1 if failures else 0)
