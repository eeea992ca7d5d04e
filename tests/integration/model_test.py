#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura model: the shipped scattering laws against numpy, by their formulas; new models, mistakes, pictures.
Usage: model_test.py OBSCURA"""
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from checks import check, failures  # noqa: E402

obscura = sys.argv[1]


def call(*arguments, folder):
    done = subprocess.run([obscura, "model", *arguments], capture_output=True, text=True, cwd=folder)
    return done.returncode, done.stdout, done.stderr


class Directions:
    """Angles of the rows of a table, as vectors: n = z, e in the plane x-z."""

    def __init__(self, rows):
        self.i, self.e, azimuth = (np.radians([float(row[key]) for row in rows])
                                   for key in ("incidence_deg", "emission_deg", "azimuth_deg"))
        self.azimuth = azimuth
        self.light = np.stack([np.sin(self.i) * np.cos(azimuth), np.sin(self.i) * np.sin(azimuth), np.cos(self.i)])
        self.camera = np.stack([np.sin(self.e), 0 * self.e, np.cos(self.e)])
        self.mu0, self.mu = np.cos(self.i), np.cos(self.e)
        # Between the directions, well conditioned at both ends.
        self.g = 2 * np.arctan2(np.linalg.norm(self.light - self.camera, axis=0), np.linalg.norm(self.light + self.camera, axis=0))


def oren_nayar(d, albedo, slope_deg):
    s2 = math.radians(slope_deg) ** 2
    a, b = 1 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09)
    alpha, beta = np.maximum(d.i, d.e), np.minimum(d.i, d.e)
    return albedo / np.pi * d.mu0 * (a + b * np.maximum(0, np.cos(d.azimuth)) * np.sin(alpha) * np.tan(beta))


def photometric(d):
    """Longitude and latitude on the sphere: luminance equator through light and camera."""
    longitude = np.arctan2(d.mu0 / d.mu - np.cos(d.g), np.sin(d.g))
    longitude = np.where(d.g > 1e-6, longitude, 0)
    return longitude, np.clip(d.mu / np.cos(longitude), 0, 1)


def akimov_disc(d, exponent=1):
    longitude, cos_latitude = photometric(d)
    share = d.g / (np.pi - d.g)
    return (np.cos(d.g / 2) * np.cos(np.pi / (np.pi - d.g) * (longitude - d.g / 2)) * cos_latitude ** (exponent * share)
            / np.cos(longitude))


def kaasalainen_shkuratov(d, normal_albedo, surge, surge_width, phase_slope, disc_exponent):
    phase = (np.exp(-phase_slope * d.g) + surge * np.exp(-d.g / surge_width)) / (1 + surge)
    return normal_albedo / np.pi * phase * np.maximum(0, akimov_disc(d, disc_exponent))


def cook_torrance(d, f0, roughness, base_albedo):
    h = d.light + d.camera
    h /= np.linalg.norm(h, axis=0)
    cos_h, cos_d = h[2], np.sum(h * d.camera, axis=0)
    tan2 = (1 - cos_h ** 2) / cos_h ** 2
    distribution = np.exp(-tan2 / roughness ** 2) / (np.pi * roughness ** 2 * cos_h ** 4)
    shadowing = np.minimum(1, np.minimum(2 * cos_h * d.mu, 2 * cos_h * d.mu0) / cos_d)
    fresnel = f0 + (1 - f0) * (1 - cos_d) ** 5
    return fresnel * distribution * shadowing / (4 * d.mu) + base_albedo * (1 - f0) / np.pi * d.mu0


def measured_phase(d, normal_albedo):
    angles = [0, 5, 10, 20, 30, 40, 50, 60, 70, 80, 90, 110, 130, 150]
    steps = [0.18, 0.20, 0.30, 0.27, 0.25, 0.24, 0.25, 0.27, 0.27, 0.28, 0.66, 0.77, 1.12]
    magnitude = np.interp(np.degrees(d.g), angles, np.concatenate([[0], np.cumsum(steps)]))
    return 2 * normal_albedo / np.pi * 10 ** (-0.4 * magnitude) * d.mu0 / (d.mu0 + d.mu)


def hapke(d, w, b, c, shadow_hiding_b0, shadow_hiding_h, backscatter_b0, backscatter_h, roughness_deg, filling_factor):
    """Hapke 2012, eq. 12.55, with the two cases of the roughness correction written out."""
    t = math.tan(math.radians(roughness_deg))
    chi = 1 / math.sqrt(1 + math.pi * t * t)
    psi = d.azimuth
    f = np.exp(-2 * np.tan(np.minimum(psi, np.pi - 1e-15) / 2))
    with np.errstate(divide="ignore"):
        cot_i, cot_e = 1 / np.tan(np.maximum(d.i, 1e-6)), 1 / np.tan(np.maximum(d.e, 1e-6))
    e1 = lambda cot: np.exp(-2 / np.pi / t * cot)
    e2 = lambda cot: np.exp(-(cot / t) ** 2 / np.pi)
    eta = lambda mu, angle, cot: chi * (mu + np.sin(angle) * t * e2(cot) / (2 - e1(cot)))
    eta_i, eta_e = eta(d.mu0, d.i, cot_i), eta(d.mu, d.e, cot_e)
    half = np.sin(psi / 2) ** 2

    def effective(cot_low, cot_high):
        """Parts of the effective cosines of the smaller and of the larger angle (i <= e: i is the smaller)."""
        under = 2 - e1(cot_high) - psi / np.pi * e1(cot_low)
        return (np.cos(psi) * e2(cot_high) + half * e2(cot_low)) / under, (e2(cot_high) - half * e2(cot_low)) / under

    small_i, large_e = effective(cot_i, cot_e)
    small_e, large_i = effective(cot_e, cot_i)
    first = d.i <= d.e
    mu0e = chi * (d.mu0 + np.sin(d.i) * t * np.where(first, small_i, large_i))
    mue = chi * (d.mu + np.sin(d.e) * t * np.where(first, large_e, small_e))
    nearer = np.where(first, d.mu0 / eta_i, d.mu / eta_e)
    shadowing = mue / eta_e * (d.mu0 / eta_i) * chi / (1 - f + f * chi * nearer)
    filling = 1.209 * filling_factor ** (2 / 3)
    k = -math.log(1 - filling) / filling if filling > 0 else 1
    r0 = (1 - math.sqrt(1 - w)) / (1 + math.sqrt(1 - w))
    h_function = lambda x: 1 / (1 - w * x * (r0 + (1 - 2 * r0 * x) / 2 * np.log((1 + x) / x)))
    cos_g, tan_half = np.cos(d.g), np.tan(d.g / 2)
    phase = ((1 + c) / 2 * (1 - b * b) / (1 - 2 * b * cos_g + b * b) ** 1.5
             + (1 - c) / 2 * (1 - b * b) / (1 + 2 * b * cos_g + b * b) ** 1.5)
    hiding = 1 + shadow_hiding_b0 / (1 + tan_half / shadow_hiding_h)
    z = tan_half / backscatter_h
    ratio = -np.expm1(-z) / np.where(z > 0, z, 1)
    coherent = backscatter_b0 * (1 + np.where(z > 0, ratio, 1)) / (2 * (1 + z) ** 2)
    return (k * w / (4 * np.pi) * mu0e / (mu0e + mue) * (phase * hiding + h_function(mu0e / k) * h_function(mue / k) - 1)
            * (1 + coherent) * shadowing)


# Law, parameters other than the defaults, formula, largest relative difference. Angles close to 0 lose digits in an arc cosine.
LAWS = [
    ("lambert", {"albedo": 0.3}, lambda d, albedo: albedo / np.pi * d.mu0, 1e-12),
    ("lommel-seeliger", {"albedo": 0.2}, lambda d, albedo: albedo / (4 * np.pi) * d.mu0 / (d.mu0 + d.mu), 1e-12),
    ("minnaert", {"albedo": 0.2, "exponent": 0.6}, lambda d, albedo, exponent: albedo / np.pi * d.mu0 ** exponent * d.mu ** (exponent - 1), 1e-12),
    ("oren-nayar", {"albedo": 0.4, "slope_deg": 25}, oren_nayar, 1e-12),
    ("akimov", {"normal_albedo": 0.2, "phase_slope": 0.8},
     lambda d, normal_albedo, phase_slope: normal_albedo / np.pi * np.exp(-phase_slope * d.g) * akimov_disc(d), 1e-12),
    ("kaasalainen-shkuratov", {"normal_albedo": 0.1, "surge": 0.4, "surge_width": 0.1, "phase_slope": 0.7, "disc_exponent": 1.3},
     kaasalainen_shkuratov, 1e-12),
    ("cook-torrance", {"f0": 0.5, "roughness": 0.3, "base_albedo": 0.2}, cook_torrance, 1e-12),
    ("measured-phase", {"normal_albedo": 0.2}, measured_phase, 1e-12),
    ("hapke", {"w": 0.3, "b": 0.25, "c": 0.4, "shadow_hiding_b0": 1.5, "shadow_hiding_h": 0.06, "backscatter_b0": 0.4,
               "backscatter_h": 0.1, "roughness_deg": 23, "filling_factor": 0.2}, hapke, 1e-12),
]

def gaussian(x, y, sigma_long, sigma_short, angle_deg):
    turn = math.radians(angle_deg)
    along, across = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]]) @ [x, y]
    return math.exp(-along ** 2 / (2 * sigma_long ** 2) - across ** 2 / (2 * sigma_short ** 2)) / (2 * math.pi * sigma_long * sigma_short)


def moffat(x, y, fwhm, beta):
    alpha = fwhm / (2 * math.sqrt(2 ** (1 / beta) - 1))
    return (beta - 1) / (math.pi * alpha ** 2) * (1 + (x * x + y * y) / alpha ** 2) ** -beta


def bessel_j1(x):
    """Bessel's integral, by the trapezoidal rule of a periodic function."""
    angle = np.linspace(0, np.pi, 2001)
    return np.trapz(np.cos(angle - x * np.sin(angle)), angle) / np.pi


def airy(x, y, obscuration, wavelength, f_number, pitch):
    scale = pitch * 1e-6 / (wavelength * 1e-9 * f_number)
    v = math.pi * scale * math.hypot(x, y)
    jinc = lambda q: 2 * bessel_j1(q) / q if q > 0 else 1
    amplitude = (jinc(v) - obscuration ** 2 * jinc(obscuration * v)) / (1 - obscuration ** 2)
    return math.pi / 4 * (1 - obscuration ** 2) * scale ** 2 * amplitude ** 2


def asymmetric(x, y, sigma, growth, field_x, field_y):
    length = math.hypot(field_x, field_y)
    u, v = (x * field_x + y * field_y) / length, (y * field_x - x * field_y) / length
    outer = sigma * (1 + growth * length / 1000)
    side = outer if u > 0 else sigma
    return 2 / (2 * math.pi * sigma * (sigma + outer)) * math.exp(-u * u / (2 * side ** 2) - v * v / (2 * sigma ** 2))


# Point spread functions: parameters, arguments besides the place, formula, largest relative difference.
PSFS = [
    ("gaussian.psf", {"sigma_long": 1.5, "sigma_short": 0.7, "angle_deg": 30}, {}, gaussian, 1e-12),
    ("moffat.psf", {"fwhm": 2.2, "beta": 2.5}, {}, moffat, 1e-12),
    ("airy.psf", {"obscuration": 0.3}, {"wavelength": 700, "f_number": 8, "pitch": 5}, airy, 5e-6),
    ("asymmetric.psf", {"sigma": 0.9, "growth": 2}, {"field_x": 400, "field_y": -300}, asymmetric, 1e-12),
]

with tempfile.TemporaryDirectory(prefix="obscura-model-") as temporary:
    folder = pathlib.Path(temporary)
    names = [entry["name"] for entry in json.loads(call("list", "--json", folder=folder)[1]) if entry["kind"] not in ("projection", "sensor", "shape", "timing")]
    tested = [law[0] for law in LAWS] + [name.removesuffix(".psf") for name, *_ in PSFS] + ["reaction-wheel"]
    tested += ["checker", "region"]  # in model_scene_test.py
    check("each shipped model is tested", sorted(names) == sorted(tested), names)
    for name, parameters, point, formula, tolerance in PSFS:
        settings = [word for key, value in parameters.items() for word in ("--set", f"{key}={value}")]
        for x, y in ((0, 0), (0.3, -0.8), (-2.5, 1.25), (6, 7)):
            at = [word for key, value in {"x": x, "y": y, **point}.items() for word in ("--at", f"{key}={value}")]
            _, said, error = call("eval", name.removesuffix(".psf"), *settings, *at, "--json", folder=folder)
            given, expected = json.loads(said)["density_per_px2"], formula(x, y, **parameters, **point)
            check(f"{name} at ({x}, {y}) px is what its formula says", abs(given - expected) <= tolerance * abs(expected) + 1e-300, (given, expected, error))
    for name, parameters, formula, tolerance in LAWS:
        settings = [word for key, value in parameters.items() for word in ("--set", f"{key}={value}")]
        status, _, error = call("plot", name, *settings, "-o", "law.csv", folder=folder)
        rows = list(csv.DictReader((folder / "law.csv").open())) if status == 0 else []
        d = Directions(rows)
        given = np.array([float(row["r_per_sr"]) for row in rows])
        expected = formula(d, **parameters)
        # An arc cosine loses half the digits of small angles, and of azimuths in the plane of incidence.
        well = (d.g > 0.02) & (np.sin(d.azimuth) > 0.1) & (d.i > 0.02) & (d.e > 0.02)
        for what, where, limit in ((f"{name} is what numpy makes of its formula", well, tolerance),
                                   (f"{name} at small angles and in the plane of incidence", ~well, 2e-5)):
            difference = np.max(np.abs(given - expected)[where] / np.maximum(np.abs(expected), 1e-9)[where])
            check(what, status == 0 and difference < limit, f"{difference} {error}")

    wheel = {"rate_hz": 37, "jitter_urad": 8, "second": 0.5, "third": 0.3, "axial": 0.2, "shift_um": 3}
    settings = [word for key, value in wheel.items() for word in ("--set", f"{key}={value}")]
    for t in (0, 0.0137, 12.3456):
        told = json.loads(call("eval", "reaction-wheel", *settings, "--at", f"t={t}", "--json", folder=folder)[1])
        phase = 2 * np.pi * 37 * t
        turns = lambda harmonic, start: np.sin(harmonic * phase + 2 * np.pi * start)
        expected = {"rotation_x_urad": 8 * (turns(1, 0.25) + 0.5 * turns(2, 0.37) + 0.3 * turns(3.16, 0.61)),
                    "rotation_y_urad": 8 * (turns(1, 0) + 0.5 * turns(2, 0.12) + 0.3 * turns(3.16, 0.86)),
                    "rotation_z_urad": 1.6 * turns(1, 0.5), "offset_x_um": 3 * turns(1, 0.25), "offset_y_um": 3 * turns(1, 0), "offset_z_um": 0}
        check(f"reaction-wheel at {t} s is what its formula says", max(abs(told[key] - value) for key, value in expected.items()) < 1e-9, (told, expected))

    status, said, error = call("new", "material", "rock", folder=folder)
    check("a new model is written", (status, said) == (0, "rock.brdf\n"), error)
    check("it is kept", call("new", "material", "rock", folder=folder)[0] == 64)
    status, said, error = call("check", "rock.brdf", folder=folder)
    check("it is sound", status == 0 and said.startswith("rock.brdf: sound: "), said + error)
    shown = json.loads(call("show", "rock.brdf", "--json", folder=folder)[1])
    check("its parameters are shown", [(p["name"], p["default"], p["unit"], p["min"], p["max"]) for p in shown["parameters"]]
          == [("albedo", [0.1], "", 0, 1), ("gloss", [0.05], "", 0, 1), ("spread", [8], "deg", 0.5, 45)], shown)
    for form, begins in (("png", b"\x89PNG"), ("svg", b"<svg"), ("csv", b"incidence_deg,")):
        status, _, error = call("plot", "rock.brdf", "-o", f"rock.{form}", folder=folder)
        check(f"it is drawn as {form}", status == 0 and (folder / f"rock.{form}").read_bytes().startswith(begins), error)
    xml.etree.ElementTree.parse(folder / "rock.svg")
    check("another ending is refused", call("plot", "rock.brdf", "-o", "rock.jpg", folder=folder)[0] == 64)

    text = (folder / "rock.brdf").read_text()
    (folder / "broken.brdf").write_text(text.replace("mu0 <= 0", "muo <= 0").replace("albedo * gloss", "albedo gloss"))
    status, said, _ = call("check", "broken.brdf", folder=folder)
    lines = text.splitlines()
    first = next(n for n, line in enumerate(lines, 1) if "mu0 <= 0" in line)
    second = next(n for n, line in enumerate(lines, 1) if "albedo * gloss" in line)
    check("all mistakes are told at their places", status == 78 and said.splitlines()
          == [f"broken.brdf:{first}:9: 'muo' is not declared; did you mean \"mu0\"?",
              f"broken.brdf:{second}:{lines[second - 1].index('albedo * gloss') + 8}: ')' is missing behind the expression, found 'gloss'"], said)
    status, said, _ = call("check", "broken.brdf", "--json", folder=folder)
    check("and as JSON", status == 78 and [json.loads(line)["line"] for line in said.splitlines()] == [first, second], said)
    check("a missing file is said", call("check", "none.brdf", folder=folder)[0] == 66)
    check("an unknown parameter is refused", "did you mean \"gloss\"" in call("eval", "rock.brdf", "--set", "glos=1", folder=folder)[2])

    (folder / "scene.toml").write_text("""[camera]
width = 32
height = 32
pixel_pitch_um = 10
focal_length_mm = 50
aperture_mm = 10
position_m = [1000, 0, 0]
boresight = [-1, 0, 0]
[sun]
direction = [1, 0.2, 0.3]
[[body]]
shape = "ellipsoid"
radii_m = [2, 2, 2]
material = { model = "rock.brdf", albedo = 0.3, spread_deg = 12 }
""")
    done = subprocess.run([obscura, "render", "scene.toml", "-o", "scene.png"], capture_output=True, text=True, cwd=folder)
    check("a scene renders with it", done.returncode == 0 and (folder / "scene.png").exists(), done.stderr)

sys.exit(1 if failures else 0)
