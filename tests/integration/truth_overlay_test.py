#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What `truth` tells of a frame is where things are: held to a lens written with numpy, to the truth table beside the
frame, and to the edge of an overexposed disc in the frame's own pixels. Positions agree within 0.05 px.

Usage: truth_overlay_test.py OBSCURA SOURCE-DIRECTORY OBSCURAD
Exit status 1 if a check failed, 77 without numpy.
"""
import csv
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
from statistics import NormalDist

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from client_checks import PATIENCE_S, check, check_refused, end, obscura_client, wait_for  # noqa: E402
import numpy as np  # noqa: E402
from numpy_lens import Lens, distances, inside, quaternion, rotation  # noqa: E402

obscurad = os.path.abspath(sys.argv[3])
TOLERANCE_PX = 0.05
WAIT_S = 60
#: Of radius and place of an edge that is fitted to pixels.
EDGE_TOLERANCE_PX = 0.05
PSF_PX = 0.6
WIDTH, HEIGHT, PITCH_UM, FOCAL_MM = 224, 176, 20, 8
F_PX = FOCAL_MM * 1e3 / PITCH_UM
#: OpenCV: k1 k2 p1 p2 k3.
DISTORTION = (-0.25, 0.12, 0.004, -0.006, 0.02)
VELOCITY_M_S = np.array((2.4e6, -1.1e6, 1.9e6))
ROCK_RADII_M = np.array((900.0, 640.0, 480.0))
ROCK_Q = np.array((0.6, -0.2, 0.7, 0.33166247903554))
MOONLET_M = 170.0
FULL_SCALE, BLACK = 4095, 64


def lens_at(position_m, q, velocity_m_s):
    return Lens(position_m, q, velocity_m_s, F_PX, DISTORTION, (WIDTH, HEIGHT))


def on_image(points, margin=0.0):
    x, y = np.asarray(points).T
    return (x >= -0.5 + margin) & (x < WIDTH - 0.5 - margin) & (y >= -0.5 + margin) & (y < HEIGHT - 0.5 - margin)


class Daemon:
    def __init__(self, scenes, settings):
        self.temporary = tempfile.TemporaryDirectory(prefix="obscura-overlay-")
        self.folder = pathlib.Path(self.temporary.name)
        for name, text in scenes.items():
            (self.folder / name).write_text(text)
        (self.folder / "obscurad.toml").write_text(f"""[scene]
file = "scene.toml"
[control]
unix_socket = "{self.folder}/calls.socket"
[monitor]
socket = "{self.folder}/monitor.socket"
[gige]
enabled = false
[file]
enabled = true
format = "raw"
directory = "frames"
truth_table = true
{settings}""")
        self.log = open(self.folder / "log", "w+", encoding="utf-8")
        self.process = subprocess.Popen([obscurad, "--config", self.folder / "obscurad.toml"], stdout=subprocess.PIPE, stderr=self.log)
        if not self.process.stdout.readline():
            self.log.seek(0)
            sys.exit(f"the daemon ended: {self.log.read()}")

    def camera(self):
        return obscura_client.connect_camera(str(self.folder / "calls.socket"), timeout_s=PATIENCE_S)

    def table(self, frame):
        """Lines of the truth table of a frame of the latest acquisition, which are written a little later than it leaves."""
        def rows():
            files = sorted((self.folder / "frames").glob("*truth.csv"), key=lambda file: file.stat().st_mtime_ns)
            if not files:
                return []
            with open(files[-1], newline="", encoding="utf-8") as lines:
                return [row for row in csv.DictReader(lines) if row["frame"] == str(frame)]
        # The last lines of a frame are those of its rows, or its limbs: all are there once their number stays.
        seen = []

        def settled():
            seen.append(len(rows()))
            return len(seen) > 2 and seen[-1] == seen[-3] > 0
        check("the truth table has the frame", wait_for(settled), sorted((self.folder / "frames").iterdir()))
        return rows()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.log.close()
        self.process.stdout.close()
        self.temporary.cleanup()


def triggered(daemon, camera):
    """One more frame, which another client waits for: that keeps the daemon looking."""
    frames = []
    with daemon.camera() as other:
        waiter = threading.Thread(target=lambda: frames.append(other.frame(triggered.number, WAIT_S)))
        waiter.start()
        # A frame that begins before the daemon has heard of the other client is not copied: then one more.
        while waiter.is_alive():
            check("the camera is ready", wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"]))
            camera.trigger()
            waiter.join(5)
        triggered.number = frames[0].number
        return frames[0]


def software(camera):
    camera.stop()
    camera.set(TriggerSource="Software")
    camera.start()
    # The last frame before is kept, and may still be on its way: what comes behind it counts.
    seen = []

    def settled():
        try:
            seen.append(camera.frame(0, 0.5).number)
        except obscura_client.errors.RequestError:
            seen.append(0)
        return len(seen) > 3 and len(set(seen[-4:])) == 1
    check("the frames before have come", wait_for(settled))
    triggered.number = seen[-1]


def sensor(shutter, extra=""):
    return f"""[sensor]
pixel_pitch_um = {PITCH_UM}
[sensor.readout]
width = {WIDTH}
height = {HEIGHT}
shutter = "{shutter}"
{extra}[sensor.detector]
read_noise_e = 0
dark_current_e_per_s = 0
gain_dn_per_e = 0.1
offset_dn = {BLACK}
"""


def ahead_of(right_ascension_deg, declination_deg):
    a, d = np.radians((right_ascension_deg, declination_deg))
    return np.array((np.cos(d) * np.cos(a), np.cos(d) * np.sin(a), np.sin(d)))


SIRIUS = (101.2872, -16.7161)
AHEAD = ahead_of(108.0, -22.0)
RIGHT = np.cross(AHEAD, (0, 0, 1)) / np.linalg.norm(np.cross(AHEAD, (0, 0, 1)))
DOWN = np.cross(AHEAD, RIGHT)
CAMERA_M = np.array((12_000.0, -7_000.0, 3_000.0))


def beside(right, down, ahead):
    return CAMERA_M + right * RIGHT + down * DOWN + ahead * AHEAD


ROCK_M, MOONLET_AT_M = beside(-330, 250, 5000), beside(240, 420, 4200)


def array_text(values):
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


def stars_of(count=260):
    """Sirius, and stars about it, all of one colour."""
    draw = np.random.default_rng(20)
    places = [SIRIUS] + [(108 + 17 * a, -22 + 13 * d) for a, d in draw.uniform(-1, 1, (count, 2))]
    magnitudes = [-1.44] + list(np.round(draw.uniform(1, 6, count), 4))
    return places, magnitudes


def scene(velocity=VELOCITY_M_S, rock=ROCK_M):
    places, magnitudes = stars_of()
    lines = "".join(f"{ra!r},{dec!r},{v!r},0.0\n" for (ra, dec), v in zip(places, magnitudes))
    others = "".join(f"""[[body]]
name = "pebble{k}"
shape = "ellipsoid"
albedo = 0.1
radii_m = [0.5, 0.5, 0.5]
position_m = {array_text(beside(80 * k - 700, 900 - 60 * k, 9000))}
""" for k in range(17))
    text = f"""aberration = true
[sun]
direction = [1, 0, 0]
distance_au = 1000
[stars]
catalogue = "stars.csv"
limiting_magnitude = 7
[camera]
focal_length_mm = {FOCAL_MM}
aperture_mm = 20
psf_sigma_px = {PSF_PX}
distortion = "opencv"
distortion_coefficients = {array_text(DISTORTION)}
velocity_m_s = {array_text(velocity)}
position_m = {array_text(CAMERA_M)}
boresight = {array_text(AHEAD)}
up = [0, 0, 1]
[[band]]
from_nm = 500
to_nm = 600
[[body]]
name = "rock"
shape = "ellipsoid"
albedo = 0.1
radii_m = {array_text(ROCK_RADII_M)}
position_m = {array_text(rock)}
orientation = {array_text(ROCK_Q)}
emission_w_m2_sr = [0.007]
[[body]]
name = "moonlet"
shape = "ellipsoid"
albedo = 0.1
radii_m = [{MOONLET_M}, {MOONLET_M}, {MOONLET_M}]
position_m = {array_text(MOONLET_AT_M)}
emission_w_m2_sr = [0.002]
[[body]]
name = "behind"
shape = "ellipsoid"
albedo = 0.1
radii_m = [100, 100, 100]
position_m = {array_text(beside(0, 0, -4000))}
{others}"""
    return {"scene.toml": text, "stars.csv": "ra_deg,dec_deg,v_mag,b_v\n" + lines}


def points_of(limb):
    return np.array([p for p in limb if p is not None]).reshape(-1, 2)


def held_to_the_lens(told):
    """Everything of a frame at rest, by the lens written here."""
    lens = lens_at(told["camera_position_m"], told["camera_orientation"], VELOCITY_M_S)
    bodies = {body["name"]: body for body in told["bodies"]}
    check("the pose is that of the scene", np.allclose(lens.position_m, CAMERA_M) and np.allclose(lens.axes[:, 2], AHEAD, atol=1e-9))
    check("all bodies are told, more than a header has", told["bodies_of"] == 20 and len(bodies) == 20, len(bodies))
    seen = [body for body in told["bodies"] if body["name"] != "behind"]
    off = np.linalg.norm(lens.of_points([body["position_m"] for body in seen]) - [(b["x"], b["y"]) for b in seen], axis=1)
    check(f"centres are where the lens has them ({off.max():.1e} px)", off.max() < TOLERANCE_PX, list(off))
    check("a body behind the camera is nowhere", bodies["behind"]["x"] is None and bodies["behind"]["limb"] == [], bodies["behind"])
    check("what is smaller than a pixel has no limb", all(bodies[f"pebble{k}"]["limb"] == [] for k in range(17)))

    outlines = {"rock": lens.limb(ROCK_M, ROCK_Q, ROCK_RADII_M), "moonlet": lens.limb(MOONLET_AT_M, (1, 0, 0, 0), np.full(3, MOONLET_M))}
    for name, outline in outlines.items():
        limb = points_of(bodies[name]["limb"])
        off = distances(limb, outline)
        check(f"the limb of the {name} is its outline ({len(limb)} points, {off.max():.1e} px)", 10 < len(limb) <= 64 and off.max() < TOLERANCE_PX, list(off))
    moonlet = bodies["moonlet"]["limb"]
    check("a limb that is all seen is closed", moonlet[0] == moonlet[-1] and None not in moonlet, moonlet)
    hidden = inside(points_of(bodies["rock"]["limb"]), outlines["moonlet"])
    check("the moonlet hides a part of the rock's limb", not hidden.any() and
          inside(outlines["rock"], outlines["moonlet"]).any() and None in bodies["rock"]["limb"], bodies["rock"]["limb"])
    check("each point says whether the Sun shines there", all(
        [lit is None for lit in b["limb_lit"]] == [p is None for p in b["limb"]] for b in told["bodies"]))
    side = points_of(bodies["moonlet"]["limb"]) - (bodies["moonlet"]["x"], bodies["moonlet"]["y"])
    sunward = side @ (lens.of_points(MOONLET_AT_M + (50, 0, 0)) - lens.of_points(MOONLET_AT_M))
    lit = np.array(bodies["moonlet"]["limb_lit"])
    check("and it shines on the Sun's side", lit.any() and not lit.all() and sunward[lit].min() > sunward[~lit].max() - 1, (sunward, lit))

    places, magnitudes = stars_of()
    expected = lens.of_directions(np.array([ahead_of(*place) for place in places]))
    covered = inside(expected, outlines["rock"]) | inside(expected, outlines["moonlet"])
    order = [k for k in np.argsort(magnitudes) if on_image(expected[k]) and not covered[k]][:100]
    stars = told["stars"]
    check("the hundred brightest stars in the image are told, the brightest first",
          len(stars) == len(order) == 100 and np.allclose([s["magnitude"] for s in stars], np.array(magnitudes)[order], atol=1e-3),
          [(len(stars), len(order)), *((s["magnitude"], magnitudes[k]) for s, k in zip(stars, order) if abs(s["magnitude"] - magnitudes[k]) > 1e-3)])
    off = np.linalg.norm([(s["x"], s["y"]) for s in stars] - expected[order], axis=1)
    check(f"stars are where the lens has them ({off.max():.1e} px)", off.max() < TOLERANCE_PX, list(off))
    check("a star has its name, where it has one", stars[0]["name"] == "Sirius" and stars[50]["name"] is None, stars[0])
    check("the window is the image", told["windows"] == [{"name": "window 0", "x": 0, "y": 0, "w": WIDTH, "h": HEIGHT, "sensor_x": 0, "sensor_y": 0}])
    return outlines


def held_to_the_table(told, rows, lens):
    """The table, which the frame itself was given, is of the same places."""
    def places(kind, name=None):
        return np.array([(float(r["x_px"]), float(r["y_px"])) for r in rows if r["kind"] == kind and name in (None, r["name"]) and
                         r["x_px"] and r["visibility"] in ("visible", "partly")]).reshape(-1, 2)
    for body in told["bodies"]:
        row = next(r for r in rows if r["kind"] == "body" and r["name"] == body["name"])
        if body["x"] is None:
            check(f"the table does not know where {body['name']} is either", row["x_px"] == "")
            continue
        off = np.hypot(float(row["x_px"]) - body["x"], float(row["y_px"]) - body["y"])
        if off >= TOLERANCE_PX or body["name"] == "rock":
            check(f"the centre of {body['name']} is that of the table", off < TOLERANCE_PX, (row, body))
    stars = places("star")
    off = [np.linalg.norm(stars - (s["x"], s["y"]), axis=1).min() for s in told["stars"]]
    check(f"stars are those of the table ({max(off, default=0):.1e} px)", max(off, default=0) < TOLERANCE_PX, list(off))
    if lens is not None:
        for name, outline in lens.items():
            off = distances(places("limb", name), outline)
            check(f"the table's limb of the {name} is the same outline ({off.max():.1e} px)", len(off) > 10 and off.max() < TOLERANCE_PX, list(off))


def edge_offsets(pixels, limb, inner, disc):
    """How far outside of a limb the edge of its disc is by each pixel of the edge below the end of the scale, px, and the normals
    of the limb there. A disc of equal light falls off as a step through PSF and pixel: about a Gaussian's integral."""
    spread = NormalDist(0, np.sqrt(PSF_PX ** 2 + 1 / 12))
    offsets, normals = [], []
    for before, point, after in zip(limb, limb[1:], limb[2:]):
        along = (after - before) / np.linalg.norm(after - before)
        normal = np.array((along[1], -along[0]))
        normal *= np.sign(normal @ (point - inner))
        # The limb curves away from its tangent.
        bend = (((before - point) @ normal) / ((before - point) @ along) ** 2 + ((after - point) @ normal) / ((after - point) @ along) ** 2) / 2
        for i, j in np.ndindex(7, 7):
            pixel = np.round(point) + (i - 3, j - 3)
            aside, out = (pixel - point) @ along, (pixel - point) @ normal
            level = (pixels[int(pixel[1]), int(pixel[0])] - BLACK) / disc if on_image(pixel) else 0
            if abs(aside) < 1 and abs(out) < 1.5 and 0.08 < level < 0.55:
                offsets.append(out - bend * aside ** 2 + spread.inv_cdf(level))
                normals.append(normal)
    return np.array(offsets), np.array(normals)


def parts_of(limb):
    parts = [[]]
    for point in limb:
        if point is None:
            parts.append([])
        else:
            parts[-1].append(point)
    return [np.array(part) for part in parts if len(part) > 2]


def at_rest():
    with Daemon(scene(), "[render]\nsamples_per_pixel = 128\n" + sensor("global")) as daemon, daemon.camera() as camera:
        software(camera)
        camera.set(ExposureTime=1000)
        short = triggered(daemon, camera)
        told = camera.call("truth")
        check("truth is of the newest frame", told["frame"] == short.frame, (told["frame"], short.frame))
        outlines = held_to_the_lens(told)
        held_to_the_table(told, daemon.table(short.frame), outlines)

        # The disc of the rock emits the same light everywhere: half of it is its edge. Overexposed, half of it is still below the end.
        rock = {body["name"]: body for body in told["bodies"]}["rock"]
        x, y = round(rock["x"]), round(rock["y"])
        disc = np.median(short.pixels[y - 3:y + 4, x - 3:x + 4].astype(float)) - BLACK
        ratio = 1.7 * (FULL_SCALE - BLACK) / disc
        camera.set(ExposureTime=1000 * ratio)
        bright = triggered(daemon, camera)
        told = camera.call("truth", frame=bright.frame)
        rock = {body["name"]: body for body in told["bodies"]}["rock"]
        pixels = bright.pixels.astype(float)
        check("the disc is overexposed", (pixels[y - 9:y + 10, x - 9:x + 10] == FULL_SCALE).all() and told["frame"] == bright.frame, (disc, ratio, pixels[y, x]))
        limbs = parts_of(rock["limb"])
        moonlet = np.array((told["bodies"][1]["x"], told["bodies"][1]["y"]))
        far = told["bodies"][1]["radius_px"] + 6  # the edge beside the moonlet is that of both
        limbs = [part[np.linalg.norm(part - moonlet, axis=1) > far] for part in limbs]
        edges = [edge_offsets(pixels, part, (rock["x"], rock["y"]), ratio * disc) for part in limbs if len(part) > 2]
        offsets, normals = (np.concatenate(column) for column in zip(*edges))
        # Noise of the samples is in each: a size and a place are fitted to all.
        (size, right, down), *_ = np.linalg.lstsq(np.column_stack((np.ones(len(offsets)), normals)), offsets, rcond=None)
        check(f"the limb is the edge of the overexposed disc in the frame's pixels ({len(offsets)} of them: {size:+.3f} px in radius, "
              f"{right:+.3f} to the right, {down:+.3f} down, {np.std(offsets):.3f} rms)",
              len(offsets) > 100 and max(map(abs, (size, right, down))) < EDGE_TOLERANCE_PX and np.std(offsets) < 0.2, list(offsets))

        # A part of the sensor.
        camera.stop()
        camera.set(OffsetX=40, OffsetY=24, Width=128, Height=96)
        camera.start()
        part = camera.call("truth", frame=triggered(daemon, camera).frame)
        check("a window of the sensor is told", part["windows"] == [{"name": "window 0", "x": 0, "y": 0, "w": 128, "h": 96, "sensor_x": 40, "sensor_y": 24}], part["windows"])
        check("and all is in its pixels", np.allclose([(b["x"], b["y"]) for b in part["bodies"] if b["x"] is not None],
                                                       [(b["x"] - 40, b["y"] - 24) for b in told["bodies"] if b["x"] is not None], atol=1e-3))
        limb = points_of(part["bodies"][0]["limb"])
        off = distances(limb + (40, 24), outlines["rock"])
        check(f"the limb, too, and only where it is seen ({len(limb)} points)", len(limb) > 10 and off.max() < TOLERANCE_PX and
              ((limb > -0.5) & (limb < (127.5, 95.5))).all(), list(limb))


BALL_M, BALL_AT_M, BALL_V = 300.0, beside(150, -420, 6000), 330 * RIGHT + 210 * DOWN
ROW_S = 1.2e-3


def ball_scene(velocity_m_s, shift_right_m=0.0):
    start, step = BALL_AT_M + shift_right_m * RIGHT, np.asarray(velocity_m_s) * 1000
    table = "time_s,x_m,y_m,z_m\n" + "".join(
        f"{t!r}," + ",".join(repr(float(v)) for v in start + step * t / 1000) + "\n" for t in (-1000.0, 0.0, 1000.0))
    name = f"ball{shift_right_m:g}"
    return {f"{name}.csv": table, f"{name}.toml": f"""[sun]
direction = {array_text(-AHEAD)}
[camera]
focal_length_mm = {FOCAL_MM}
aperture_mm = 20
distortion = "opencv"
distortion_coefficients = {array_text(DISTORTION)}
position_m = {array_text(CAMERA_M)}
boresight = {array_text(AHEAD)}
up = [0, 0, 1]
[[body]]
name = "ball"
shape = "ellipsoid"
albedo = 0.1
radii_m = [{BALL_M}, {BALL_M}, {BALL_M}]
trajectory = "{name}.csv"
"""}


def row_by_row():
    """A rolling shutter: each row shows its own time. And a frame keeps its scene when another one is shown."""
    files = ball_scene(BALL_V) | ball_scene(BALL_V, 900.0)
    files["scene.toml"] = files["ball0.toml"]
    clock = f"pixel_clock_hz = {WIDTH / (ROW_S - 1e-6)}\n"
    with Daemon(files, sensor("rolling", clock)) as daemon, daemon.camera() as camera:
        software(camera)
        camera.set(ExposureTime=3000)
        frame = triggered(daemon, camera)
        told = camera.call("truth", frame=frame.frame)
        rows = daemon.table(frame.frame)
        held_to_the_table(told, rows, None)
        first = next(r for r in rows if r["kind"] == "rows" and r["item"] == "0")
        mid = next(r for r in rows if r["kind"] == "pose" and r["name"] == "ball")
        # The mid-exposure of the frame is half way between the first reset and the last read.
        mid_of_first_s = (int(first["time_ns"]) - int(mid["time_ns"])) * 1e-9
        mid_of_row_s = lambda y: mid_of_first_s * (1 - 2 * y / (HEIGHT - 1))
        check("rows are apart in time", abs(-2 * mid_of_first_s - (HEIGHT - 1) * ROW_S) < 1e-6, (mid_of_first_s, first, mid))
        lens = lens_at(CAMERA_M, told["camera_orientation"], np.zeros(3))
        ball = told["bodies"][0]
        at_mid = np.array([float(mid[f"position_{axis}_m"]) for axis in "xyz"])
        check("the pose is that of the table", np.allclose(ball["position_m"], at_mid, atol=1e-6), (ball, mid))
        ends = lens.of_points([at_mid + BALL_V * mid_of_row_s(0), at_mid + BALL_V * mid_of_row_s(HEIGHT - 1)])
        motion = np.array([(p["x"], p["y"]) for p in (ball["motion"]["start"], ball["motion"]["end"])])
        check(f"the motion is from the first to the last row ({np.abs(motion - ends).max():.1e} px of {np.linalg.norm(ends[1] - ends[0]):.1f})",
              np.abs(motion - ends).max() < TOLERANCE_PX and np.linalg.norm(ends[1] - ends[0]) > 3, (motion, ends))
        at = lens.of_points([at_mid])[0]
        for _ in range(50):  # the row that shows it
            at = lens.of_points([at_mid + BALL_V * mid_of_row_s(at[1])])[0]
        check("its centre is where its row shows it", np.hypot(*(at - (ball["x"], ball["y"]))) < TOLERANCE_PX, (at, ball))
        off = np.array([distances([p], lens.limb(at_mid + BALL_V * mid_of_row_s(p[1]), (1, 0, 0, 0), np.full(3, BALL_M), 4000))[0]
                        for p in points_of(ball["limb"])])
        check(f"each point of its limb is where its row shows it ({off.max():.1e} px)", len(off) > 30 and off.max() < TOLERANCE_PX, list(off))

        camera.call("scene.show", file="ball900.toml")
        again = camera.call("truth", frame=frame.frame)
        check("a frame keeps its scene when another is shown", again == told, again)
        other = triggered(daemon, camera)
        later = camera.call("truth", frame=other.frame)["bodies"][0]
        check("the next one has the other", np.linalg.norm(np.subtract(later["position_m"], ball["position_m"])) > 800, later)
        check_refused("of a scene that is gone nothing is told, rather than of another", "not-now", "of a scene that has been replaced",
                      lambda: wait_for(lambda: camera.call("truth", frame=frame.frame) is None))
        check_refused("nor of a frame that nobody looked at", "not-now", "frame 4711 is not one of the latest", lambda: camera.call("truth", frame=4711))


def of_its_own_poses():
    """A simulator moves the scene on: what is told is of the poses that the frame was made with."""
    files = {"scene.toml": ball_scene(np.zeros(3))["ball0.toml"], "ball0.csv": ball_scene(np.zeros(3))["ball0.csv"]}
    settings = """[simulator]
enabled = true
listen = "127.0.0.1:0"
[trigger]
source = "lockstep"
"""
    with Daemon(files, settings + sensor("global")) as daemon, daemon.camera() as camera:
        axes = np.stack((RIGHT, DOWN, AHEAD), axis=1)
        q = quaternion(axes @ rotation((np.cos(0.02), 0, np.sin(0.02), 0)))
        place = CAMERA_M + 40 * RIGHT
        camera.pose("camera", 0.5, tuple(place), tuple(q))
        step = camera.step(0.5)
        for k in range(100):  # more than the simulator's memory of poses holds
            camera.pose("camera", 1 + 0.01 * k, tuple(CAMERA_M + (100 + k) * DOWN), tuple(quaternion(axes)))
        told = camera.call("truth", frame=step["frame"])
        ball = told["bodies"][0]
        lens = lens_at(place, q, np.zeros(3))
        check("the pose is the frame's", np.allclose(told["camera_position_m"], place), told["camera_position_m"])
        off = np.hypot(*(lens.of_points([BALL_AT_M])[0] - (ball["x"], ball["y"])))
        check(f"so is the place of the ball ({off:.1e} px)", off < TOLERANCE_PX, ball)
        off = distances(points_of(ball["limb"]), lens.limb(BALL_AT_M, (1, 0, 0, 0), np.full(3, BALL_M)))
        check(f"and its limb ({off.max():.1e} px)", len(off) == 64 and off.max() < TOLERANCE_PX, list(off))
        check("nothing moves", "motion" not in ball, ball)


if __name__ == "__main__":
    at_rest()
    row_by_row()
    of_its_own_poses()
    sys.exit(end())
