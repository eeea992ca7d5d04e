#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Case study: the Jovian system with the shadows of Io and Ganymede on Jupiter, through a lens with chromatic aberration.

Usage: jovian_system.py OBSCURA [--kernel FILE] [--samples N] [--output FOLDER] [--json FILE]
Takes Jupiter and the Sun from the DE405 kernel, Jupiter's rotation and the radii from the text PCK of OBSCURA_DATA (default
../shared/data), and the moons from --kernel, an SPK kernel that has them (jup365.bsp), or from the largest terms of the theory E5
(galilean_moons.py). Writes a scene and a table of point spread functions, renders, and holds shadows and colours against closed
forms; exit status 1 where one is further off than it may be, 77 where data or numpy are missing. With --output also the pictures and
the table of docs/cases/jovian-system.md.
"""
import argparse
import importlib.util
import json
import math
import pathlib
import sys
import tempfile

if not importlib.util.find_spec("numpy"):
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)
import numpy as np

import case_files
import galilean_moons
from case_geometry import iau_rotation, quaternion_of, text_kernel
from case_report import Report

TIME = "2026-08-02T23:00:00 TDB"
SUN_RADIUS_KM, LIMB_DARKENING = 695700.0, 0.6
DISTANCE_KM, PHASE_DEG, ABOVE_DEG = 6.0e6, 22.0, 3.0  # of the camera: from Jupiter, from the Sun's direction, above the equator
WIDTH, HEIGHT, PITCH_UM, FOCAL_MM = 4096, 1320, 5.5, 220.0
BANDS = [(600, 700), (500, 600), (400, 500)]  # red, green, blue
# The lens: lateral colour, radial shift of each band at the corner of the sensor, and axial colour, standard deviation of the spot.
LATERAL_PX, SIGMA_PX = (1.6, 0.0, -1.6), (1.1, 0.8, 1.3)
PLACES, OVERSAMPLING, REACH_PX = (9, 3), 4, 8


def state(obscura, kernels, target, observer):
    """Geometric position and velocity of a body relative to another, km and km/s, ICRF axes; and TDB seconds from J2000."""
    told = json.loads(case_files.run(obscura, "ephemeris", *kernels, "--target", target, "--observer", observer, "--time", TIME,
                                     "--see", "geometric", "--json"))["places"][0]
    return np.array(told["position_km"]), np.array(told["velocity_km_s"]), told["tdb_s"]


class System:
    """Sun, camera and moons relative to Jupiter, km, ICRF axes, all at one instant: light times, 4 s at most between the bodies, are
    left out."""

    def __init__(self, obscura, kernel):
        de405 = case_files.data_file("ephemeris/de405_2000-2050.bsp")
        self.kernels = text_kernel(case_files.data_file("ephemeris/pck00010.tpc"))
        self.sun, velocity, self.tdb_s = state(obscura, [de405], "SUN", "JUPITER BARYCENTER")
        self.axes = iau_rotation(self.kernels, 599, self.tdb_s)
        orbit_pole = np.cross(self.sun, velocity)
        if kernel:
            self.moons = {name: state(obscura, [de405, kernel], name.upper(), "JUPITER")[0] for name in galilean_moons.NAMES}
        else:
            self.moons = galilean_moons.positions_km(self.tdb_s, self.axes[:, 2], orbit_pole / np.linalg.norm(orbit_pole))
        pole, sunward = self.axes[:, 2], self.sun / np.linalg.norm(self.sun)
        flat = sunward - (sunward @ pole) * pole
        flat /= np.linalg.norm(flat)
        phase, above = math.radians(PHASE_DEG), math.radians(ABOVE_DEG)
        level = math.cos(phase) * flat + math.sin(phase) * np.cross(pole, flat)
        self.camera = DISTANCE_KM * (math.cos(above) * level + math.sin(above) * pole)
        # Half way between Jupiter and Ganymede, Jupiter's north up.
        away = [v / np.linalg.norm(v) for v in (-self.camera, self.moons["ganymede"] - self.camera)]
        z = (away[0] + away[1]) / np.linalg.norm(away[0] + away[1])
        x = np.cross(z, pole)
        x /= np.linalg.norm(x)
        self.attitude = np.stack([x, np.cross(z, x), z], axis=1)

    def radii(self, code):
        return np.array(self.kernels[f"BODY{code}_RADII"])

    def pixel(self, place):
        """Pixel of a place, x right, y down; (0, 0) is the centre of the first."""
        p = (place - self.camera) @ self.attitude
        return np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2]) + p[:2] / p[2] * FOCAL_MM * 1e3 / PITCH_UM

    def scene(self, psf="", moons=True, bands=None):
        def numbers(values, scale=1.0):
            return "[" + ", ".join(repr(float(v) * scale) for v in values) + "]"
        text = f"""# The Jovian system on {TIME}. ICRF axes, origin Jupiter's centre. Made by tests/cases/jovian_system.py.
name = "jovian-system"
max_bounces = 1
[sun]
position_m = {numbers(self.sun, 1e3)}
radius_m = {SUN_RADIUS_KM * 1e3}
limb_darkening = {LIMB_DARKENING}
[camera]
width = {WIDTH}
height = {HEIGHT}
pixel_pitch_um = {PITCH_UM}
focal_length_mm = {FOCAL_MM}
aperture_mm = 40
{psf or "psf_sigma_px = 0"}
position_m = {numbers(self.camera, 1e3)}
orientation = {numbers(quaternion_of(self.attitude))}
[[body]]
name = "jupiter"
shape = "ellipsoid"
radii_m = {numbers(self.radii(599), 1e3)}
orientation = {numbers(quaternion_of(self.axes))}
material = "jupiter"
"""
        for name, place in self.moons.items() if moons else ():
            code = galilean_moons.NAMES[name]
            text += f"""[[body]]
name = "{name}"
shape = "ellipsoid"
radii_m = {numbers(self.radii(code), 1e3)}
position_m = {numbers(place, 1e3)}
orientation = {numbers(quaternion_of(iau_rotation(self.kernels, code, self.tdb_s)))}
material = "{name}"
"""
        for first, last in bands or [BANDS[1]]:
            text += f"[[band]]\nfrom_nm = {first}\nto_nm = {last}\n"
        return text

    def shadow_centre(self, moon):
        """Where the line from the Sun through a moon meets Jupiter first."""
        way = self.moons[moon] - self.sun
        way /= np.linalg.norm(way)
        radii = self.radii(599)
        start, along = (self.moons[moon] @ self.axes) / radii, (way @ self.axes) / radii
        a, b, c = along @ along, start @ along, start @ start - 1
        return self.moons[moon] + way * (-b - math.sqrt(b * b - a * c)) / a


def colour_offsets(x, y):
    """Shift of the three bands at a pixel by lateral colour, px: radial, in proportion to the distance from the axis."""
    from_axis = np.array([x - (WIDTH - 1) / 2, y - (HEIGHT - 1) / 2])
    return [from_axis * shift / math.hypot(WIDTH / 2, HEIGHT / 2) for shift in LATERAL_PX]


def write_psf(file):
    side = 2 * REACH_PX * OVERSAMPLING + 1
    grid = (np.arange(side) - side // 2) / OVERSAMPLING
    images = []
    for y in np.linspace(0, HEIGHT - 1, PLACES[1]):
        for x in np.linspace(0, WIDTH - 1, PLACES[0]):
            for band, (offset, sigma) in enumerate(zip(colour_offsets(x, y), SIGMA_PX)):
                spot = np.exp(-((grid[None, :] - offset[0])**2 + (grid[:, None] - offset[1])**2) / (2 * sigma**2))
                images.append((spot, {"OVERSAMP": OVERSAMPLING, "FIELDX": x, "FIELDY": y, "BAND": band + 1}))
    case_files.write_fits(file, images)


def sunlight_past(system, moon, points):
    """Share of the sunlight that passes a moon, taken as a ball, at points of Jupiter: rays to 2,500 points of the Sun's disc."""
    place, radius = system.moons[moon], system.radii(galilean_moons.NAMES[moon]).mean()
    towards = system.sun / np.linalg.norm(system.sun)
    side = np.cross(towards, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    steps = (np.arange(56) + 0.5) / 28 - 1
    u, v = (g[steps[None, :]**2 + steps[:, None]**2 < 1] for g in np.meshgrid(steps, steps))
    weight = 1 - LIMB_DARKENING * (1 - np.sqrt(1 - u**2 - v**2))
    suns = system.sun + SUN_RADIUS_KM * (np.outer(u, side) + np.outer(v, np.cross(towards, side)))
    out = []
    for point in points:
        rays = suns - point
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        to_moon = place - point
        along = rays @ to_moon
        passes = (to_moon @ to_moon - along**2 > radius**2) | (along < 0)
        out.append((weight * passes).sum() / weight.sum())
    return np.array(out)


def places_of(layers, radii_km, axes):
    """Points of Jupiter at the pixels, from planetocentric latitude and longitude."""
    latitude, longitude = np.radians(layers["latitude_deg"]), np.radians(layers["longitude_deg"])
    direction = np.stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)], axis=-1)
    return direction / np.linalg.norm(direction / radii_km, axis=-1)[..., None] @ axes.T


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("obscura", type=pathlib.Path)
    parser.add_argument("--kernel", type=pathlib.Path)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--output", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path, help="write the figures here")
    options = parser.parse_args()
    system = System(options.obscura, options.kernel)
    report = Report()
    temporary = tempfile.TemporaryDirectory(prefix="obscura-jovian-")
    folder = pathlib.Path(temporary.name)
    render = case_files.renderer(options.obscura, folder)

    if not options.kernel:
        stand_in(report)
    shadows = []
    for moon in ("io", "ganymede"):
        x, y = np.rint(system.pixel(system.shadow_centre(moon))).astype(int)
        half = 24
        window = ["--window", f"{x - half},{y - half},{2 * half}x{2 * half}", "--samples", 16 * options.samples, "--layers"]
        with_moons, without = render(moon, system.scene(), *window), render(f"no-{moon}", system.scene(moons=False), *window)
        found = with_moons[""] / without[""]
        points = places_of(without, system.radii(599), system.axes)
        expected = sunlight_past(system, moon, points.reshape(-1, 3)).reshape(found.shape)
        # Where no other moon's disc is before it.
        seen = with_moons["body"] == 1
        off = float(np.abs(found - expected)[seen].max())
        rms = float(np.sqrt(((found - expected)[seen]**2).mean()))
        width = penumbra_km(system, moon)
        report.add(f"shadow of {moon.capitalize()}", f"rms difference {rms:.4f}, largest {off:.3f} of the sunlight",
                   f"rays to the Sun's disc; penumbra {width:.0f} km or {width / km_per_pixel():.1f} px wide", rms, 0.01, "")
        shadows.append((found, expected))
    write_psf(folder / "psf.fits")
    text = system.scene(psf=f'psf = "table"\npsf_file = "psf.fits"\npsf_core_px = {REACH_PX - 1}', bands=BANDS)
    picture = render("system", text, "--samples", options.samples)[""]
    # Lateral colour: the centroid of Ganymede in red and in blue.
    x, y = np.rint(system.pixel(system.moons["ganymede"])).astype(int)
    planes = render("ganymede", text, "--window", f"{x - 32},{y - 32},65x65", "--samples", 16 * options.samples)[""]
    found = centroid(planes[0]) - centroid(planes[2])
    offsets = colour_offsets(x, y)
    expected = offsets[0] - offsets[2]
    report.add("Ganymede's red image from its blue one", f"{found[0]:+.3f}, {found[1]:+.3f} px",
               f"lens {expected[0]:+.3f}, {expected[1]:+.3f} px", float(np.abs(found - expected).max()), 0.05, "px")
    report.print()
    if options.json:
        options.json.write_text(json.dumps(report.figures, indent=1))
    if options.output:
        pictures(options.output, picture, shadows, planes)
        report.into_page(options.output / "jovian-system.md")
    sys.exit(0 if report.good else 1)


def stand_in(report):
    """Io and Europa by the stand-in theory against JPL's jup260, as the header of a LORRI frame has it."""
    header, _ = case_files.read_fits(case_files.data_file("flight_nh_lorri/lor_0034974380_0x630_sci_1_cropped.fit"))
    kernels = text_kernel(case_files.data_file("ephemeris/pck00010.tpc"))

    def vector(key):
        return np.array([header[key + axis] for axis in "XYZ"])
    tdb_s = header["SPCSCET"] - 8
    orbit_pole = np.cross(vector("SPC1SO"), vector("SPC1SOV"))
    places = galilean_moons.positions_km(tdb_s, iau_rotation(kernels, 599, tdb_s)[:, 2], orbit_pole / np.linalg.norm(orbit_pole))
    for moon, key in (("io", "SPCTSC"), ("europa", "SPC3SC")):
        off = float(np.linalg.norm(places[moon] - (vector("SPC1SC") - vector(key))))
        report.add(f"stand-in for {moon.capitalize()}", f"{off:.0f} km off", "jup260 in a flight header, 2007-02-28", off, 500, "km")


def km_per_pixel():
    return DISTANCE_KM * PITCH_UM * 1e-3 / FOCAL_MM


def penumbra_km(system, moon):
    """Width of the penumbra across the light."""
    far = np.linalg.norm(system.moons[moon] - system.shadow_centre(moon))
    return 2 * SUN_RADIUS_KM / np.linalg.norm(system.sun) * far


def centroid(image):
    y, x = np.indices(image.shape)
    return np.array([(image * x).sum(), (image * y).sum()]) / image.sum()


def pictures(folder, picture, shadows, ganymede):
    # White is what a white surface would be: each band over its share of the sunlight, W/m2 in 100 nm (ASTM E490).
    def colour(planes):
        return np.stack([plane / sun for plane, sun in zip(planes, (158.0, 182.0, 188.0))], axis=-1)
    white = np.percentile(colour(picture)[picture.max(axis=0) > 0], 99)
    quarter = colour(picture).reshape(HEIGHT // 4, 4, WIDTH // 4, 4, 3).mean(axis=(1, 3))
    case_files.write_png(folder / "jovian-system.png", case_files.grey(quarter, 0, white, gamma=2.2))
    near = case_files.grey(colour(ganymede), 0, np.percentile(colour(ganymede), 99), gamma=2.2)
    case_files.write_png(folder / "jovian-colour.png", case_files.enlarged(near, 6))
    rows = []
    for found, expected in shadows:
        panels = [case_files.grey(found, 0, 1.05), case_files.grey(expected, 0, 1.05), case_files.grey(found - expected, -0.1, 0.1)]
        rows.append(case_files.beside(*(case_files.enlarged(p, 5) for p in panels)))
    case_files.write_png(folder / "jovian-shadows.png", np.concatenate([rows[0], np.full((6, rows[0].shape[1]), 255, np.uint8), rows[1]]))


if __name__ == "__main__":
    main()
