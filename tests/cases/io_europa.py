#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Case study: the crescents of Io and Europa as New Horizons saw them together on 2 March 2007, 10:34 UTC.

Usage: io_europa.py OBSCURA [--samples N] [--output FOLDER] [--json FILE]
No kernel of that day is at hand: New Horizons is carried on from its place and velocity in the header of the LORRI frame of 28 February
(OBSCURA_DATA, default ../shared/data) under Jupiter and the Sun, the moons are by the stand-in of galilean_moons.py. Compares what
NASA published with the picture, renders the two moons through LORRI and compares their night sides. Exit status 1 where a figure is
further off than it may be, 77 where data or numpy are missing. With --output also the picture and the table of docs/cases/io-europa.md.
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
import io_lorri
from case_geometry import SPEED_OF_LIGHT_KM_S, iau_rotation, text_kernel
from case_report import Report

LATER_S = 163177.669  # from the header's time, 2007-02-28T13:14:22.331 UTC
JUPITER_SYSTEM_KM3_S2 = 126712764.8  # JUP230; of the Sun: IAU
SUN_KM3_S2 = 1.32712440018e11


class Pair(io_lorri.Frame):
    """The scene of that minute; km, J2000 axes, Jupiter's centre as the origin."""

    def __init__(self, header, kernels):
        super().__init__(header)
        sun, sun_velocity = (np.array([header[key + axis] for axis in "XYZ"]) for key in ("SPC1SO", "SPC1SOV"))
        place, velocity = (np.array([header[key + axis] for axis in "XYZ"]) for key in ("SPC1SC", "SPC1SCV"))
        orbit_pole = np.cross(sun, sun_velocity)
        place, velocity = carried_on(place, velocity, sun, sun_velocity)
        self.camera, self.sun = place, sun + LATER_S * sun_velocity
        self.velocity = velocity - sun_velocity  # relative to the Sun
        self.tdb_s += LATER_S
        self.axes = {599: iau_rotation(kernels, 599, self.tdb_s - np.linalg.norm(place) / SPEED_OF_LIGHT_KM_S)}
        self.places = {599: np.zeros(3)}
        for name, code in galilean_moons.NAMES.items():
            if name not in ("io", "europa"):
                continue
            light_s = 0.0
            for _ in range(3):
                self.places[code] = galilean_moons.positions_km(self.tdb_s - light_s, self.axes[599][:, 2],
                                                                orbit_pole / np.linalg.norm(orbit_pole))[name]
                light_s = np.linalg.norm(place - self.places[code]) / SPEED_OF_LIGHT_KM_S
            self.axes[code] = iau_rotation(kernels, code, self.tdb_s - light_s)
        # Half way between the two, Jupiter's north up.
        ways = [self.places[code] - place for code in (501, 502)]
        z = sum(way / np.linalg.norm(way) for way in ways)
        # Where aberration shows them.
        z = z / np.linalg.norm(z) + self.velocity / SPEED_OF_LIGHT_KM_S
        z /= np.linalg.norm(z)
        x = np.cross(z, self.axes[599][:, 2])
        x /= np.linalg.norm(x)
        self.attitude = np.stack([x, np.cross(z, x), z], axis=1)

    def angle_deg(self, at, one, other):
        """Angle at a body between the directions to two places."""
        a, b = one - self.places[at], other - self.places[at]
        return math.degrees(math.acos(a @ b / np.linalg.norm(a) / np.linalg.norm(b)))


def carried_on(place, velocity, sun, sun_velocity, steps=4000):
    """Place and velocity relative to Jupiter LATER_S on, under Jupiter's system and the tide of the Sun; Runge and Kutta's method."""
    def change(t, state):
        p, far = state[:3], sun + t * sun_velocity
        off = far - p
        pull = (-JUPITER_SYSTEM_KM3_S2 * p / np.linalg.norm(p)**3 +
                SUN_KM3_S2 * (off / np.linalg.norm(off)**3 - far / np.linalg.norm(far)**3))
        return np.concatenate([state[3:], pull])
    state, dt = np.concatenate([place, velocity]), LATER_S / steps
    for k in range(steps):
        t = k * dt
        a = change(t, state)
        b = change(t + dt / 2, state + dt / 2 * a)
        c = change(t + dt / 2, state + dt / 2 * b)
        d = change(t + dt, state + dt * c)
        state = state + dt / 6 * (a + 2 * b + 2 * c + d)
    return state[:3], state[3:]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("obscura", type=pathlib.Path)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--output", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path, help="write the figures here")
    options = parser.parse_args()
    flight = case_files.data_file("flight_nh_lorri")
    header, _ = case_files.read_fits(flight / "lor_0034974380_0x630_sci_1_cropped.fit")
    kernels = text_kernel(flight / "kernels/pck00010.tpc", flight / "kernels/nh_lorri_v201.ti")
    pair = Pair(header, kernels)
    report = Report()
    io, europa = (float(np.linalg.norm(pair.places[code] - pair.camera)) for code in (501, 502))
    gap = float(np.linalg.norm(pair.places[501] - pair.places[502]))
    for what, found, published, digit in (("range of Io", io, 4.6e6, 0.05e6), ("range of Europa", europa, 3.8e6, 0.05e6),
                                          ("from Io to Europa", gap, 0.79e6, 0.005e6)):
        report.add(what, f"{found:.0f} km", f"published {published:.0f} km", abs(found - published), digit, "km")
    with tempfile.TemporaryDirectory(prefix="obscura-io-europa-") as folder:
        scene, image = pathlib.Path(folder) / "pair.toml", pathlib.Path(folder) / "pair.fits"
        scene.write_text(io_lorri.scene_of(pair, kernels, {"jupiter": 599, "io": 501, "europa": 502}))
        case_files.run(options.obscura, "render", scene, "-o", image, "--layers", "--samples", options.samples)
        layers = case_files.read_fits(image)[1]
    sun = io_lorri.SunInBand()
    full = sun.band_w_m2 / (np.linalg.norm(pair.sun) / 149597870.7)**2 / math.pi  # radiance of I/F = 1
    levels = {}
    for number, (name, code) in enumerate((("Io", 501), ("Europa", 502)), start=1):
        with np.errstate(invalid="ignore"):
            night = (layers["body"] == number + 1) & (layers["incidence_deg"] > 97) & (layers["emission_deg"] < 75)
        levels[name] = float(layers[""][night].mean() / full)
        report.say(f"night side of {name}, mean", f"I/F {levels[name]:.2e}",
                   f"phase {pair.angle_deg(code, pair.sun, pair.camera):.0f} deg; its side towards Jupiter is turned "
                   f"{pair.angle_deg(code, pair.places[599], pair.camera):.0f} deg away")
    ratio = levels["Europa"] / levels["Io"]
    report.add("night side of Europa over Io's", f"{ratio:.1e}", "published: Io's is lit by Jupiter, Europa's is dark", ratio, 0.1, "")
    report.print()
    if options.json:
        options.json.write_text(json.dumps(report.figures, indent=1))
    if options.output:
        picture = layers[""] / full
        case_files.write_png(options.output / "io-europa.png", case_files.grey(picture[320:704, 192:832], 0, 4 * levels["Io"]))
        report.into_page(options.output / "io-europa.md")
    sys.exit(0 if report.good else 1)


if __name__ == "__main__":
    main()
