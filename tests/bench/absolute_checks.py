#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders small scenes and compares their absolute figures with published or closed-form values, as a Markdown table.

Usage: absolute_checks.py OBSCURA [--only NAME,...] [--output FILE] [--keep FOLDER]
OBSCURA: the program in its build tree. Plain Python; rows whose data are not in OBSCURA_DATA (default ../shared/data) say
so. Exit status 1 if a figure is further off than its row allows. docs/validation.md includes the table.
"""
import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
from read_image import read_fits  # noqa: E402

DATA = pathlib.Path(os.environ.get("OBSCURA_DATA", ROOT.parent / "shared/data"))
AU = 149597870700.0

# Bessell, UBVRI passbands, PASP 102, 1181 (1990), table 2: first wavelength in nm, then every 10 nm.
V_BAND = (470, [0, .03, .163, .458, .78, .967, 1, .973, .898, .792, .684, .574, .461, .359, .27, .197, .135, .081, .045,
                .025, .017, .013, .009, 0])
I_BAND = (700, [0, .024, .232, .555, .785, .91, .965, .985, .99, .995, 1, 1, .99, .98, .95, .91, .86, .75, .56, .33, .15,
                .03, 0])


class Bench:
    """Renders scenes; keeps the rows of the table."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        self.rows, self.failed = [], False

    def planes(self, name, scene, *options):
        """Planes of a rendered scene: (width, height, list of tuples)."""
        scene_file, picture = self.folder / f"{name}.toml", self.folder / f"{name}.fits"
        scene_file.write_text(scene)
        run = subprocess.run([self.program, "render", scene_file, "-o", picture, "--json", *map(str, options)],
                             capture_output=True, text=True, check=False)
        if run.returncode != 0:
            sys.exit(f"{name}: {run.stderr.strip()}")
        return planes_of(picture)

    def sums(self, name, scene, *options):
        """Irradiance of each band over the whole picture, W/m2."""
        return [math.fsum(plane) for plane in self.planes(name, scene, *options)[2]]

    def row(self, quantity, ours, wanted, allowed_percent, source, unit="", difference=None, scale=100):
        """One row: the difference in percent, or in `unit` with `scale` 1."""
        off = (ours / wanted - 1) * scale if difference is None else difference
        self.failed |= not abs(off) <= allowed_percent
        word = "%" if scale == 100 else unit
        self.rows.append(f"| {quantity} | {ours:.4g} {unit} | {wanted:.4g} {unit} | {off:+.2f} {word} | "
                         f"{allowed_percent:g} {word} | {source} |")

    def skipped(self, quantity, why):
        self.rows.append(f"| {quantity} | | | skipped: {why} | | |")


def planes_of(path):
    """Planes of a FITS image."""
    values, _, header = read_fits(path.read_bytes())
    width, height = int(header["NAXIS1"]), int(header["NAXIS2"])
    size = width * height
    return width, height, [values[first:first + size] for first in range(0, len(values), size)]


def bands(*ranges):
    return "".join(f"[[band]]\nfrom_nm = {a}\nto_nm = {b}\n" for a, b in ranges)


def passband(curve):
    first, values = curve
    points = ", ".join(f"[{first + 10 * i}, {v}]" for i, v in enumerate(values))
    return f"[[band]]\nfrom_nm = {first}\nto_nm = {first + 10 * (len(values) - 1)}\ntransmission = [{points}]\n"


def camera(position, target, field_rad, size=64, up=(0, 0, 1), extra=""):
    focal_mm = 0.01 * size / (2 * math.tan(field_rad / 2))
    return (f"[camera]\nwidth = {size}\nheight = {size}\npixel_pitch_um = 10\nfocal_length_mm = {focal_mm!r}\n"
            f"psf_sigma_px = 0\nposition_m = {list(map(float, position))}\nlook_at_m = {list(map(float, target))}\n"
            f"up = {list(map(float, up))}\n{extra}")


def sphere(radius_m, phase_rad, distance_m, keys, band_text, sun_au=1.0):
    """A sphere at the origin seen by the camera from +x, the Sun at the phase angle."""
    sun = [math.cos(phase_rad), math.sin(phase_rad), 0.0]
    return (f"[sun]\ndirection = {sun}\ndistance_au = {sun_au}\n"
            + camera([distance_m, 0, 0], [0, 0, 0], 2.4 * radius_m / distance_m)
            + f"[[body]]\nshape = \"ellipsoid\"\nradii_m = [{radius_m}, {radius_m}, {radius_m}]\n{keys}\n{band_text}")


def star(bench, name, cells, header, band_text):
    (bench.folder / f"{name}.csv").write_text(f"ra_deg,dec_deg,v_mag,{header}\n0,0,{cells}\n")
    return bench.sums(name, f"[sun]\nirradiance_scale = 0\n[stars]\ncatalogue = \"{name}.csv\"\n"
                      + camera([0, 0, 0], [1, 0, 0], 0.1, 32) + band_text)


def check_sun(bench):
    # Integrals of the published table, ASTM E490-00a, W/m2.
    wanted = {400: 186.23, 500: 184.89, 600: 159.00, 700: 126.69, 800: 101.53}
    radius, distance, albedo = 1000.0, 1e9, 0.5
    found = bench.sums("sun", sphere(radius, 0, distance, f"material = \"lambert\"\nalbedo = {albedo}",
                                     bands(*((nm, nm + 100) for nm in wanted))), "--samples", 64)
    for flux, (nm, value) in zip(found, wanted.items()):
        bench.row(f"Sun at 1 au, {nm}-{nm + 100} nm, from a Lambert sphere at phase 0",
                  flux / (2 / 3 * albedo * (radius / distance) ** 2), value, 0.5, "ASTM E490-00a; 2/3 A (R/d)^2", "W/m2")


def check_vega(bench):
    found = star(bench, "vega", "0.03,0.0", "b_v",
                 bands((495, 505), (550.6, 560.6), (674, 684), (705, 715), (773, 783), (804, 814)))
    absolute = 3.44e-8
    bench.row("Vega, 555.6 nm", found[1] / 0.01, absolute, 1, "Bohlin, Gordon, Tremblay 2014", "W m-2 um-1")
    # AB magnitudes between the lines, relative to 555.6 nm.
    for index, nm, magnitude in ((0, 500.0, -0.059), (2, 679.0, 0.261), (3, 710.0, 0.316), (4, 778.0, 0.442),
                                 (5, 809.0, 0.473)):
        bench.row(f"Vega, {nm:g} nm", found[index] / 0.01,
                  absolute * 10 ** (-0.4 * (magnitude - 0.044)) * (555.6 / nm) ** 2, 1,
                  "Hayes and Latham 1975, scaled; the spectrum is made from it", "W m-2 um-1")


def check_classes(bench):
    """Worst 100 nm band from 400 to 900 nm of each class that the data folder has."""
    first, values = V_BAND
    wide = bands(*((nm, nm + 100) for nm in range(400, 900, 100))) + passband(V_BAND)
    for name in ("o5v", "b0v", "b3v", "b8v", "a0v", "a5v", "f0v", "f5v", "g0v", "g2v", "g5v", "k0v", "k5v", "m0v", "m5v",
                 "g8iii", "k0iii", "k3iii", "k5iii", "m0iii", "m3iii", "m5iii"):
        file = DATA / f"spectra/pickles/{name}.sed.ext"
        title = f"{name.upper()}, worst band of 100 nm from 400 to 900 nm, over V"
        if not file.exists():
            continue
        points = [tuple(map(float, line.split()[:2])) for line in file.read_text().splitlines() if line.strip()]
        found = star(bench, name, f"0,{name.upper()}", "spectral_type", wide)

        def weight(nm):
            place = (nm - first) / 10
            index = int(place)
            if place < 0 or index >= len(values) - 1:
                return 0.0
            return values[index] + (place - index) * (values[index + 1] - values[index])

        v = math.fsum(flux * weight(a / 10) for a, flux in points)
        worst = max((((found[i] / found[5]) / (math.fsum(flux for a, flux in points if 4000 + 1000 * i <= a < 5000 + 1000 * i)
                                              / v), 400 + 100 * i) for i in range(5)), key=lambda x: abs(x[0] - 1))
        bench.row(title, worst[0], 1, 3, f"Pickles 1998, from which the spectra are made; the worst band is {worst[1]}-{worst[1] + 100} nm")
    # Zero points of V and I from Vega, which has 0 in both but for 0.03.
    vega = star(bench, "vega_vi", "0.03,0.0", "b_v", passband(V_BAND) + passband(I_BAND))
    # K stars with the median B-V of their class; M stars go by their type, of which the library has the spectra.
    medians, library = "medians from which the spectra are made", "medians; the spectrum is the library's"
    for name, b_v, v_i, allowed, made in (("K0III", "1.030", 1.00, 0.05, medians), ("K3III", "1.352", 1.32, 0.05, medians),
                                          ("K5III", "1.529", 1.57, 0.05, medians), ("M0III", "", 1.72, 0.05, library),
                                          ("M3III", "", 2.28, 0.12, library), ("M5III", "", 2.94, 0.05, library)):
        found = star(bench, f"{name}_vi", f"0,{b_v},{name}", "b_v,spectral_type", passband(V_BAND) + passband(I_BAND))
        colour = -2.5 * math.log10(found[0] / found[1] * vega[1] / vega[0])
        title = f"{name} of B-V {b_v}, V-I" if b_v else f"{name}, V-I"
        bench.row(title, colour, v_i, allowed, f"Hipparcos (ESA 1997): {made}", "mag", colour - v_i, 1)


def rolo(phase_deg):
    """Kieffer and Stone 2005, eq. 10, 553.8 nm, mean libration, mean of waxing and waning."""
    g = math.radians(phase_deg)
    return math.exp(-2.12504 - 1.65970 * g + 0.38409 * g ** 2 - 0.20655 * g ** 3 + 0.37206 * math.exp(-phase_deg / 4.06054)
                    - 0.10745 * math.exp(-phase_deg / 12.8802) + 0.00347 * math.cos((phase_deg + 30.5858) / 16.7498))


def check_moon(bench):
    radius, distance = 1737400.0, 3.844e8 * 100  # as from afar: the curves are reduced to that
    band = bands((550, 560))
    sun = bench.sums("moon_sun", sphere(1e3, 0, 1e9, "albedo = 1", band), "--samples", 64)[0] / (2 / 3 * 1e-12)
    for phase in (2, 5, 10, 20, 40, 60, 90, 120):
        flux = bench.sums(f"moon_{phase}", sphere(radius, math.radians(phase), distance, "material = \"moon\"", band),
                          "--samples", 16)[0]
        albedo = flux / (sun * (radius / distance) ** 2)
        bench.row(f"Moon, disc-integrated, phase {phase} deg", albedo, rolo(phase), 5,
                  "Kieffer and Stone 2005 (ROLO), 553.8 nm")
        if phase >= 5:
            allen = 0.12 * 10 ** (-0.4 * (0.026 * phase + 4e-9 * phase ** 4))
            bench.row(f"Moon, disc-integrated, phase {phase} deg", albedo, allen, 5, "Allen, V")


def check_galilean(bench):
    """V at mean opposition from geometric albedo and radius; bodies smaller than a pixel."""
    zero = star(bench, "v_zero", "0,0.65", "b_v", passband(V_BAND))[0]
    distance = 5.2026 * AU
    # The last number: what the error of the published albedo allows, for Callisto that its two values are 0.19 apart.
    for name, radius_km, albedo, magnitude, allowed in (("Io", 1821.6, 0.63, 5.02, 0.05), ("Europa", 1560.8, 0.67, 5.29, 0.05),
                                                        ("Ganymede", 2631.2, 0.43, 4.61, 0.08),
                                                        ("Callisto", 2410.3, 0.17, 5.65, 0.2)):
        r = radius_km * 1e3
        scene = (f"[sun]\nposition_m = [{distance}, 0.0, 0.0]\n" + camera([distance - AU, 0, 0], [0, 0, 0], 1e-3)
                 + f"[[body]]\nshape = \"ellipsoid\"\nradii_m = [{r}, {r}, {r}]\nmaterial = \"lunar-lambert\"\n"
                   f"normal_albedo = {albedo}\nweight = [1, 0, 0, 0]\n" + passband(V_BAND))
        ours = -2.5 * math.log10(bench.sums(name.lower(), scene, "--samples", 64)[0] / zero)
        bench.row(f"{name} at mean opposition, V, {2 * r / (distance - AU) / 1e-3 * 64:.2f} pixels across", ours, magnitude, allowed,
                  f"JPL satellite parameters: geometric albedo {albedo}, radius {radius_km} km", "mag", ours - magnitude, 1)


def check_planetshine(bench):
    """Night side of a Lambert Moon in the light of a full Lambert Earth."""
    earth, moon, distance, a_earth, a_moon = 6371e3, 1737.4e3, 3.844e8, 0.3, 0.12
    aside = math.radians(20)  # the Sun: no eclipse, and the point looked at is dark
    sun = (-math.cos(aside), 0.0, math.sin(aside))
    # Moon at the origin, Earth on +x: the Moon's side towards it is dark and Earth nearly full. A camera near the Moon.
    scene = (f"max_bounces = 1\nquantity = \"radiance\"\n[sun]\ndirection = {list(sun)}\n"
             + camera([moon + 3e6, 0, 0], [0, 0, 0], 0.01, 32)
             + f"[[body]]\nname = \"moon\"\nshape = \"ellipsoid\"\nradii_m = [{moon}, {moon}, {moon}]\nalbedo = {a_moon}\n"
               f"[[body]]\nname = \"earth\"\nshape = \"ellipsoid\"\nradii_m = [{earth}, {earth}, {earth}]\nalbedo = {a_earth}\n"
               f"position_m = [{distance}, 0, 0]\n" + bands((500, 600)))
    width, height, planes = bench.planes("planetshine", scene, "--samples", 256)
    mean = math.fsum(planes[0]) / (width * height)
    # E1 over pi, by midpoint over the visible cap of Earth: L = A E0 cos(i) / pi, dE1 = L cos(t) dw.
    total, steps = 0.0, 400
    half = math.asin(earth / (distance - moon))
    for i in range(steps):
        cosine = 1 - (i + 0.5) / steps * (1 - math.cos(half))
        sine = math.sqrt(1 - cosine * cosine)
        reach = distance - moon
        ray = reach * cosine - math.sqrt(max(0.0, earth ** 2 - (reach * sine) ** 2))
        for j in range(72):
            phi = 2 * math.pi * (j + 0.5) / 72
            point = (ray * cosine - reach, ray * sine * math.cos(phi), ray * sine * math.sin(phi))
            total += max(0.0, sum(p * s for p, s in zip(point, sun)) / earth) * cosine
    solid = 2 * math.pi * (1 - math.cos(half)) / (steps * 72)
    irradiance = a_earth / math.pi * total * solid
    e0 = 184.89
    bench.row("Planetshine: Moon's night side under Earth, both Lambert, 500-600 nm", mean, a_moon / math.pi * irradiance * e0,
              1, "integral over Earth's disc; ASTM E490", "W m-2 sr-1")


def rectangle_irradiance(point, normal, corners):
    """Irradiance over the radiance of a Lambertian polygon that is wholly above the horizon (Lambert's formula)."""
    def sub(a, b):
        return [x - y for x, y in zip(a, b)]

    def cross(a, b):
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    def unit(a):
        length = math.sqrt(sum(x * x for x in a))
        return [x / length for x in a]

    total = 0.0
    for a, b in zip(corners, corners[1:] + corners[:1]):
        u, v = unit(sub(a, point)), unit(sub(b, point))
        angle = math.acos(max(-1.0, min(1.0, sum(x * y for x, y in zip(u, v)))))
        total += angle * sum(x * y for x, y in zip(unit(cross(u, v)), normal))
    return abs(total) / 2


def check_cornell(bench):
    text = (ROOT / "config/scenes/cornell.toml").read_text()
    text = text.replace("max_bounces = 12", "max_bounces = 0")
    point = (0.10, 0.0, 0.42)  # of the floor, which no block hides from the light
    head, rest = text.split("[camera]")
    text = head + camera([0.10, 0.30, 0.42], point, 0.02, 16, (0, 0, 1)) + rest[rest.index("\n[[band]]"):]
    planes = bench.planes("cornell", text, "--samples", 1024)[2]
    light = [[0.343, 0.5487, 0.227], [0.343, 0.5487, 0.332], [0.213, 0.5487, 0.332], [0.213, 0.5487, 0.227]]
    factor = rectangle_irradiance(point, (0, 1, 0), light)
    reflectance = [0.343, 0.753, 0.747, 0.738, 0.74, 0.7295, 0.737]
    emission = [0, 4, 8, 11.8, 15.6, 17, 18.4]
    for i in range(1, 7):
        bench.row(f"Cornell box, {400 + 50 * i} nm, floor in direct light", math.fsum(planes[i]) / len(planes[i]),
                  reflectance[i] / math.pi * emission[i] * factor, 1, "Lambert's formula for a polygon", "relative")


CHECKS = {"sun": check_sun, "vega": check_vega, "classes": check_classes, "moon": check_moon, "galilean": check_galilean,
          "planetshine": check_planetshine, "cornell": check_cornell}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("obscura", type=pathlib.Path)
    parser.add_argument("--only", default=",".join(CHECKS), help=f"of {', '.join(CHECKS)}")
    parser.add_argument("--output", type=pathlib.Path, help="file to write the table into (default: standard output)")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for scenes and pictures, which are kept then")
    options = parser.parse_args()
    names = options.only.split(",")
    unknown = [name for name in names if name not in CHECKS]
    if unknown:
        sys.exit(f"--only {unknown[0]}: allowed {', '.join(CHECKS)}")
    with tempfile.TemporaryDirectory(prefix="obscura-absolute-") as scratch:
        folder = options.keep or pathlib.Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        bench = Bench(options.obscura.resolve(), folder)
        text = ""
        for name in names:
            bench.rows = []
            CHECKS[name](bench)
            text += f"`tests/bench/absolute_checks.py OBSCURA --only {name}`:\n\n"
            text += "| quantity | rendered | wanted | difference | allowed | source |\n|---|---|---|---|---|---|\n"
            text += "\n".join(bench.rows) + "\n\n"
    if options.output:
        options.output.write_text(text)
    else:
        print(text, end="")
    return 1 if bench.failed else 0


if __name__ == "__main__":
    sys.exit(main())
