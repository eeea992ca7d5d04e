#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Poses and headers, by readers of their own: `obscura pose` against geometry, the headers of pictures against
where bodies are in them, and the tables of docs/tables.md against the programs.
Usage: aiming_test.py OBSCURA OBSCURAD"""
import json
import math
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
obscura, obscurad = sys.argv[1:3]
folder = pathlib.Path(tempfile.mkdtemp())
failures = []


def check(good, what):
    if not good:
        failures.append(what)
        print("FAILED:", what)


def near(a, b, tolerance, what):
    check(abs(a - b) <= tolerance, f"{what}: {a}, expected {b} within {tolerance}")


def run(*arguments, status=0):
    done = subprocess.run([obscura, *map(str, arguments)], capture_output=True, text=True, cwd=folder)
    check(done.returncode == status, f"{arguments}: exit {done.returncode}: {done.stderr}")
    return done.stdout if status == 0 else done.stderr


def write(name, text):
    (folder / name).write_text(text)
    return folder / name


# Vectors and quaternions (w, x, y, z), written down here once more.
def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def norm(a):
    return math.sqrt(dot(a, a))


def angle_deg(a, b):
    return math.degrees(math.atan2(norm(cross(a, b)), dot(a, b)))


def matrix(q):
    """Rotation from the own to the outer frame."""
    w, x, y, z = q
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def into(q, v):
    """The inertial vector `v` in the own frame."""
    m = matrix(q)
    return [sum(m[r][c] * v[r] for r in range(3)) for c in range(3)]


def fits_units(file):
    """Header (a dict) and pixels (rows of numbers, None without) of each unit, by the FITS standard."""
    data, at, units = pathlib.Path(file).read_bytes(), 0, []
    while at < len(data):
        header, ended = {}, False
        while not ended:
            block, at = data[at:at + 2880].decode("ascii"), at + 2880
            for card in (block[i:i + 80] for i in range(0, 2880, 80)):
                key = card[:8].strip()
                if key == "END":
                    ended = True
                    break
                if card[8:10] != "= ":
                    continue
                check(re.fullmatch(r"[A-Z0-9_-]{1,8}", key), f"{file}: keyword {key}")
                text = card[10:]
                if text.lstrip().startswith("'"):
                    header[key] = re.match(r"\s*'((?:[^']|'')*)'", text)[1].rstrip()
                else:
                    value = text.split("/")[0].strip()
                    header[key] = value == "T" if value in "TF" else float(value)
        sizes = [int(header[f"NAXIS{i + 1}"]) for i in range(int(header["NAXIS"]))]
        count = math.prod(sizes) if sizes else 0
        size, code = {8: (1, "B"), 16: (2, "h"), 32: (4, "i"), -32: (4, "f"), -64: (8, "d")}[int(header["BITPIX"])]
        pixels = None
        if len(sizes) >= 2 and header.get("XTENSION", "IMAGE") == "IMAGE":
            values = struct.unpack(f">{count}{code}", data[at:at + count * size])
            values = [v * header.get("BSCALE", 1) + header.get("BZERO", 0) for v in values]
            pixels = [values[y * sizes[0]:(y + 1) * sizes[0]] for y in range(sizes[1])]
        units.append((header, pixels))
        at += (count * size + int(header.get("PCOUNT", 0)) + 2879) // 2880 * 2880
    return units


def exr_attributes(file):
    """Attributes of the header, by the OpenEXR file layout."""
    data, at, found = pathlib.Path(file).read_bytes(), 8, {}
    check(data[:4] == b"\x76\x2f\x31\x01", f"{file}: no OpenEXR file")

    def text():
        nonlocal at
        end = data.index(b"\0", at)
        word, at = data[at:end].decode(), end + 1
        return word
    while data[at]:
        name, kind = text(), text()
        size = struct.unpack_from("<i", data, at)[0]
        value, at = data[at + 4:at + 4 + size], at + 4 + size
        found[name] = struct.unpack("<d", value)[0] if kind == "double" else value.decode(errors="replace")
    return found


def centroid(rows, background=0.0):
    total = sum(max(0, v - background) for row in rows for v in row)
    x = sum(max(0, v - background) * i for row in rows for i, v in enumerate(row)) / total
    y = sum(max(0, v - background) * j for j, row in enumerate(rows) for v in row) / total
    return x, y


def opencv_point(k, f, c, p):
    """Pixel of the point `p` (camera axes) by OpenCV's formula, k1 k2 p1 p2 k3 k4 k5 k6."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (list(k) + [0] * 8)[:8]
    x, y = p[0] / p[2], p[1] / p[2]
    r2 = x * x + y * y
    radial = (1 + k1 * r2 + k2 * r2 ** 2 + k3 * r2 ** 3) / (1 + k4 * r2 + k5 * r2 ** 2 + k6 * r2 ** 3)
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return f[0] * u + c[0], f[1] * v + c[1]


def pixel_by_header(h, body):
    """Pixel of the body's centre in the file, from nothing but its header."""
    check(h["DISTMODL"] == "opencv" and h["PROJ"] == "pinhole", f"lens {h['DISTMODL']} {h['PROJ']}")
    k = [float(h[f"DIST{i:02}"]) for i in range(int(h["DISTN"]))]
    camera = [h[f"CAM_{axis}"] for axis in "XYZ"]
    q = [h[f"CAM_Q{axis}"] for axis in "WXYZ"]
    p = into(q, minus([h[f"{body}_{axis}"] for axis in "XYZ"], camera))
    x, y = opencv_point(k, (h["FX"], h["FY"]), (h["CX"], h["CY"]), p)
    return x - h.get("WINDOWX", h.get("OFFSETX", 0)), y - h.get("WINDOWY", h.get("OFFSETY", 0))


LENS = """
width = 300
height = 200
pixel_pitch_um = 10
pixel_pitch_y_um = 15
focal_length_mm = 4
psf_sigma_px = 0.6
distortion = "opencv"
distortion_coefficients = [-0.12, 0.03, 0.002, -0.003, 0.004, 0.01]
principal_offset_px = [7.25, -4.5]
"""
SCENE = f"""
[sun]
direction = [0.3, -0.2, -1]
[camera]
{LENS}
trajectory = "way.csv"
look_at_m = [60, 20, 0]
up = [0.1, -1, 0]
[[body]]
name = "ball"
shape = "ellipsoid"
radii_m = [1.5, 1.5, 1.5]
albedo = 0.3
emission_w_m2_sr = [1e5]
trajectory = "path.csv"
[[body]]
name = "far"
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.3
position_m = [0, 0, 1e6]
"""


def test_pose():
    write("way.csv", "time_s,x_m,y_m,z_m\n0,0,0,-300\n10,10,-20,-310\n")
    write("path.csv", "time_s,x_m,y_m,z_m\n0,-40,-30,0\n10,-45,-25,6\n")
    write("s.toml", SCENE)
    said = json.loads(run("pose", "s.toml", "--from", 0, "--to", 10, "--step", 2.5, "--json"))
    check([p["time_s"] for p in said["poses"]] == [0, 2.5, 5, 7.5, 10], "times")
    sun = [x * 149597870700 / math.sqrt(0.09 + 0.04 + 1) for x in (0.3, -0.2, -1)]
    for pose in said["poses"]:
        t = pose["time_s"] / 10
        camera = [10 * t, -20 * t, -300 - 10 * t]
        ball = [-40 - 5 * t, -30 + 5 * t, 6 * t]
        for a, b in zip(pose["position_m"], camera):
            near(a, b, 1e-9, "position")
        q = pose["orientation"]
        near(norm(q), 1, 1e-14, "|q|")
        view = into(q, minus([60, 20, 0], camera))
        near(angle_deg(view, [0, 0, 1]), 0, 1e-6, "boresight")
        up = into(q, [0.1, -1, 0])
        check(abs(up[0]) < 1e-12 and up[1] < 0, "up")
        body = pose["bodies"][0]
        near(body["range_m"], norm(minus(ball, camera)), 1e-9, "range")
        near(body["phase_deg"], angle_deg(minus(sun, ball), minus(camera, ball)), 1e-9, "phase")
        p = into(q, minus(ball, camera))
        near(body["off_axis_deg"], angle_deg(p, [0, 0, 1]), 1e-9, "off axis")
        x, y = opencv_point([-0.12, 0.03, 0.002, -0.003, 0.004, 0.01], (400, 4e3 / 15),
                            (149.5 + 7.25, 99.5 - 4.5), p)
        near(body["pixel"][0], x, 1e-8, "pixel x")
        near(body["pixel"][1], y, 1e-8, "pixel y")
        check(body["in_picture"] and not pose["sun"]["in_picture"], "in the picture")
    # As a trajectory it gives the same poses.
    write("poses.csv", run("pose", "s.toml", "--from", 0, "--to", 10, "--step", 2.5, "--csv"))
    again = SCENE.replace('trajectory = "way.csv"\nlook_at_m = [60, 20, 0]\nup = [0.1, -1, 0]',
                          'trajectory = "poses.csv"')
    write("again.toml", again)
    same = json.loads(run("pose", "again.toml", "--trajectory", "--json"))
    for a, b in zip(said["poses"], same["poses"]):
        check(all(abs(x - y) < 1e-14 for x, y in zip(a["orientation"], b["orientation"])), "attitude from CSV")
    # A computed pose has what was asked for, and can be pasted.
    for phase, azimuth in ((0, 0), (30, 0), (75, 90), (110, 200), (180, 10)):
        text = run("pose", "s.toml", "--time", 4, "--look-at", "ball", "--range", 80, "--phase", phase, "--azimuth",
                   azimuth, "--up", "0,1,0")
        pasted = "\n".join(re.findall(r"^(?:position_m|orientation) = .*$", text, re.MULTILINE))
        write("pasted.toml", SCENE.replace('trajectory = "way.csv"\nlook_at_m = [60, 20, 0]\nup = [0.1, -1, 0]', pasted))
        pose = json.loads(run("pose", "pasted.toml", "--time", 4, "--json"))["poses"][0]
        body = pose["bodies"][0]
        near(body["range_m"], 80, 1e-9, "range asked for")
        near(body["phase_deg"], phase, 2e-6, "phase asked for")
        near(body["pixel"][0], 149.5 + 7.25, 1e-6, "pixel of the body aimed at")
        if 0 < phase < 180:
            ball = [-42, -28, 2.4]
            to_sun = minus(sun, ball)
            right = cross(to_sun, [0, 1, 0])
            upward = cross(right, to_sun)
            stand = minus(pose["position_m"], ball)
            reached = math.degrees(math.atan2(dot(stand, upward) / norm(upward), dot(stand, right) / norm(right)))
            near((reached - azimuth + 180) % 360, 180, 1e-6, "azimuth")
    moved = json.loads(run("pose", "s.toml", "--look-at", "far", "--position", "1,2,3", "--json"))["poses"][0]
    check(moved["position_m"] == [1, 2, 3], "position asked for")
    near(moved["bodies"][1]["off_axis_deg"], 0, 1e-6, "aimed from a position")
    check("there are ball, far, sun" in run("pose", "s.toml", "--look-at", "moon", status=64), "names of bodies")
    for wrong in (["--from", "1"], ["--csv", "--json"], ["--range", "5"], ["--look-at", "ball", "--phase", "5"],
                  ["--look-at", "ball", "--position", "1,2"], ["--time", "1", "--from", "0", "--to", "2"]):
        run("pose", "s.toml", *wrong, status=64)


def test_headers():
    for window in ((), ("--window", "2,30,150x140")):
        for name in ("a.fits", "a.exr"):
            run("render", "s.toml", "-o", name, "--time", 4, "--samples", 64, "--intrinsics", "a.json", *window)
        header, pixels = fits_units(folder / "a.fits")[0]
        x, y = centroid(pixels)
        by_fits = pixel_by_header(header, "B0")
        near(by_fits[0], x, 0.03, "column by the FITS header")
        near(by_fits[1], y, 0.03, "row by the FITS header")
        exr = {key: value if not re.fullmatch(r"-?\d+", str(value)) else float(value)
               for key, value in exr_attributes(folder / "a.exr").items()}
        by_exr = pixel_by_header(exr, "B0")
        near(by_exr[0], by_fits[0], 1e-6, "column by the EXR header")
        near(by_exr[1], by_fits[1], 1e-6, "row by the EXR header")
        for key, value in (("PIXCENTR", 0), ("CAMAXES", "x right, y down, z boresight"), ("BODY0", "ball")):
            check(header[key] == value, f"{key} = {header[key]}")
        # What OpenCV would do with the JSON file.
        beside = json.loads((folder / "a.json").read_text())
        k = beside["camera_matrix"]["data"]
        frame = beside["frames"][0]
        r, t = frame["R"]["data"], frame["t"]["data"]
        body = frame["bodies"][0]["position_m"]
        p = [dot(r[3 * i:3 * i + 3], body) + t[i] for i in range(3)]
        u, v = opencv_point(beside["distortion_coefficients"]["data"], (k[0], k[4]), (k[2], k[5]), p)
        near(u, x, 0.03, "column by the JSON file")
        near(v, y, 0.03, "row by the JSON file")
        check([beside["image_width"], beside["image_height"]] == [len(pixels[0]), len(pixels)], "size in JSON")


def test_other_lenses():
    """A rotated sensor goes into R and t; the fisheye by OpenCV's formula; what OpenCV lacks is left out."""
    lens = SCENE.replace('distortion = "opencv"\ndistortion_coefficients = [-0.12, 0.03, 0.002, -0.003, 0.004, 0.01]\n', "LENS")
    fisheye = 'projection = "equidistant"\ndistortion = "radial"\ndistortion_coefficients = [-0.1, 0.02]\n'
    for keys, function in (('sensor_rotation_deg = 25\ndistortion = "radial"\ndistortion_coefficients = [-0.1, 0.02, 0.01]\n',
                            "cv::projectPoints"),
                           ("sensor_rotation_deg = -40\n" + fisheye, "cv::fisheye::projectPoints"),
                           ('projection = "equisolid"\n', None)):
        write("lens.toml", lens.replace("LENS", keys))
        run("render", "lens.toml", "-o", "l.fits", "--time", 2, "--samples", 64, "--intrinsics", "l.json")
        x, y = centroid(fits_units(folder / "l.fits")[0][1])
        beside = json.loads((folder / "l.json").read_text())
        check(beside.get("opencv_function") == function, f"function {beside.get('opencv_function')}")
        if function is None:
            check("distortion_coefficients" not in beside, "no coefficients without a function")
            continue
        k, d, frame = (beside["camera_matrix"]["data"], beside["distortion_coefficients"]["data"], beside["frames"][0])
        r, t = frame["R"]["data"], frame["t"]["data"]
        p = [dot(r[3 * i:3 * i + 3], frame["bodies"][0]["position_m"]) + t[i] for i in range(3)]
        if "fisheye" in function:
            across = math.hypot(p[0], p[1])
            a = math.atan2(across, p[2])
            bent = a * (1 + d[0] * a ** 2 + d[1] * a ** 4 + d[2] * a ** 6 + d[3] * a ** 8)
            u, v = k[0] * bent * p[0] / across + k[2], k[4] * bent * p[1] / across + k[5]
        else:
            u, v = opencv_point(d, (k[0], k[4]), (k[2], k[5]), p)
        near(u, x, 0.03, f"column by the JSON file, {function}")
        near(v, y, 0.03, f"row by the JSON file, {function}")


def test_captured():
    write("c.toml", """[scene]
file = "s.toml"
[sensor]
pixel_pitch_um = 10
pixel_pitch_y_um = 15
[sensor.readout]
width = 300
height = 200
[sensor.detector]
full_well_e = 1e6
quantum_efficiency = [[400, 1e-3], [900, 1e-3]]
offset_dn = 10
read_noise_e = 1
gain_dn_per_e = 0.01
[camera]
exposure_us = 1000
""")
    run("capture", "c.toml", "-n", 2, "-o", "out", "--format", "fits", "--truth", "--exr", "--intrinsics", "out/c.json")
    beside = json.loads((folder / "out/c.json").read_text())
    check([f["file"] for f in beside["frames"]] == ["frame_000001.fits", "frame_000002.fits"], "files in JSON")
    for number in (1, 2):
        header, pixels = fits_units(folder / f"out/frame_{number:06}.fits")[0]
        x, y = centroid(pixels, background=20)
        by_header = pixel_by_header(header, "B0")
        near(by_header[0], x, 0.1, "column by a frame's header")
        near(by_header[1], y, 0.1, "row by a frame's header")
        truth = fits_units(folder / f"out/truth_{number:06}.fits")[0][0]
        exr = exr_attributes(folder / f"out/ideal_{number:06}.exr")
        for key in ("DISTMODL", "DIST00", "CAM_QW", "SENSROT"):
            check(truth[key] == header[key], f"{key} of the truth file")
            near_or_same = exr[key] == header[key] or abs(float(exr[key]) - header[key]) < 1e-12
            check(near_or_same, f"{key} of the EXR file: {exr[key]}")
        frame = beside["frames"][number - 1]
        near(frame["orientation_wxyz"][0], header["CAM_QW"], 1e-12, "attitude in JSON")


def test_streamed():
    """The daemon's file transport has the lens in its headers too."""
    text = (folder / "c.toml").read_text()
    write("d.toml", text + """trigger_mode = "On"
trigger_source = "Line0"
[trigger]
source = "timer"
rate_hz = 5
[gige]
enabled = false
[file]
enabled = true
directory = "streamed"
format = "fits"
""")
    daemon = Child([obscurad, "--config", str(folder / "d.toml")], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                              text=True)
    first = folder / "streamed/frame_000001.fits"
    end = time.monotonic() + 60
    while not first.exists() and daemon.poll() is None and time.monotonic() < end:
        time.sleep(0.05)
    daemon.terminate()
    said = daemon.communicate()[1]
    if not first.exists():
        check(False, f"no frame from the daemon: {said}")
        return
    header, pixels = fits_units(first)[0]
    x, y = centroid(pixels, background=20)
    by_header = pixel_by_header(header, "B0")
    near(by_header[0], x, 0.1, "column by a streamed frame's header")
    near(by_header[1], y, 0.1, "row by a streamed frame's header")


def test_tables():
    """The tables of the page are read, and it lists the columns that the programs know."""
    page = (ROOT / "docs/tables.md").read_text()
    blocks = re.findall(r"```csv ([^\n]*)\n(.*?)```", page, re.DOTALL)
    check(len(blocks) == 6, f"{len(blocks)} tables in docs/tables.md")
    body = '[[body]]\nname = "rock"\nshape = "ellipsoid"\nradii_m = [1, 1, 1]\nalbedo = 0.5\n'
    uses = {
        "trajectory": "[camera]\ntrajectory = \"t.csv\"\n" + body,
        "trajectory with look_at": "[camera]\ntrajectory = \"t.csv\"\nlook_at = \"rock\"\n" + body,
        "trajectory over a body": "[camera]\nparent = \"rock\"\ntrajectory = \"t.csv\"\nlook_at = \"rock\"\n" + body,
        "attitude": "[camera]\nattitude = \"t.csv\"\n" + body,
        "joint": body + body.replace("rock", "arm") + 'parent = "rock"\njoint = "hinge"\njoint_table = "t.csv"\n',
        "stars": "[stars]\ncatalogue = \"t.csv\"\n" + body,
    }
    sections = {"trajectory": "Trajectory", "attitude": "Attitude table", "joint": "Joint table", "stars": "Star catalogue"}
    for kind, table in blocks:
        write("t.csv", table)
        write("user.toml", uses[kind])
        run("check", "--scene", "user.toml")
        if kind not in sections:
            continue
        write("t.csv", "nonsense\n1\n")
        allowed = re.search(r'allowed "([^"]*)"', run("check", "--scene", "user.toml", status=78))[1]
        columns = re.findall(r"\w+", allowed)
        section = page.split(f"## {sections[kind]}\n")[1].split("\n## ")[0]
        for column in columns:
            check(f"`{column}`" in section, f"docs/tables.md does not describe {column}")


test_pose()
test_headers()
test_other_lenses()
test_captured()
test_streamed()
test_tables()
sys.exit(1 if failures else print("poses, headers and tables agree with geometry and pictures") or 0)
