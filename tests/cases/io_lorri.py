#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Case study: Io by the light of the Sun and of Jupiter, as New Horizons' LORRI saw it on 28 February 2007.

Usage: io_lorri.py OBSCURA [--frame FILE] [--samples N] [--output FOLDER]
Takes attitude, positions, time and calibration from the header of the flight frame lor_0034974380_0x630_sci_1 in
OBSCURA_DATA (default ../shared/data), the camera from the mission's instrument kernel and Io's rotation from the text PCK,
writes a scene, renders it and prints how it agrees; exit status 1 where a figure is further off than it may be, 77 where
data or numpy are missing. With --output also the pictures and the table of docs/cases/io-lorri.md.
--frame: the same frame with all of its 1024 x 1024 pixels, to compare limb, terminator and night side with.
"""
import argparse
import csv
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
from case_geometry import SPEED_OF_LIGHT_KM_S, iau_rotation, latitude_longitude, quaternion_of, rotation_of, text_kernel
from case_report import Report

SIZE = 1024
PIVOT_UM = 0.607620  # header: PIVOT
# Responsivity of LORRI (no filter, back-illuminated CCD), relative: a curve with the ends of the passband and the pivot wavelength
# of the header, not a measured one.
RESPONSE = [(350, 0.05), (400, 0.17), (500, 0.55), (600, 0.93), (700, 1.00), (800, 0.65), (850, 0.40)]
PSF_SIGMA_PX = 0.7  # FWHM of about 1.6 pixels


class Frame:
    """What the header of the frame says; km, J2000 axes, the target's centre as the origin."""

    def __init__(self, header):
        def vector(key):
            return np.array([header[key + axis] for axis in "XYZ"])
        self.header = header
        self.tdb_s = header["SPCSCET"]
        self.camera = vector("SPCTSC")            # light-time corrected, without stellar aberration
        self.sun = vector("SPCTSO")
        self.jupiter = self.camera - vector("SPC1SC")
        self.velocity = -vector("SPCSSCV")        # of the camera relative to the Sun
        self.light_time_s = float(np.linalg.norm(self.camera)) / SPEED_OF_LIGHT_KM_S
        # Instrument axes (X columns, Y rows of the file, -Z boresight) to those of the scene's camera: x right, y down, z
        # boresight; the picture is the file's, first row at the bottom.
        instrument = rotation_of([header["SPCQ" + k] for k in "AXYZ"])
        self.attitude = instrument @ np.diag([1.0, -1.0, -1.0])
        self.places = {501: np.zeros(3), 599: self.jupiter}
        self.axes = {}

    def turn_bodies(self, kernels):
        """Sets the axes of the bodies when the light left the target."""
        self.axes = {code: iau_rotation(kernels, code, self.tdb_s - self.light_time_s) for code in self.places}


def scene_text(frame, kernels, attitude=None, white=False):
    """The scene file. `white`: Io and Jupiter as white Lambert surfaces."""
    return scene_of(frame, kernels, {"io": 501, "jupiter": 599}, attitude, white)


def scene_of(frame, kernels, bodies, attitude=None, white=False):
    focal_mm = kernels["INS-98301_OOC_FOCAL_LENGTH"][0]
    em2, em5, em6 = kernels["INS-98301_OOC_EM"]
    # Owen and O'Connell: dX = X (EM2 R^2 + EM5 Y + EM6 X), dY = Y (...), in mm, Y up: exactly OpenCV's radial, tangential and
    # prism terms k1, p1, p2, s1, s3 with y down and lengths over the focal length.
    k1, a5, a6 = em2 * focal_mm**2, -em5 * focal_mm, em6 * focal_mm
    opencv = [k1, 0, a5 / 2, a6 / 2, 0, 0, 0, 0, -a6 / 2, 0, -a5 / 2, 0]

    def numbers(values, scale=1.0):
        return "[" + ", ".join(repr(float(v) * scale) for v in values) + "]"
    text = f"""# A scene as New Horizons' LORRI saw it, J2000 axes. Made by tests/cases of Obscura's sources.
name = "lorri"
max_bounces = 1
aberration = true
quantity = "radiance"
[sun]
position_m = {numbers(frame.sun, 1e3)}
[camera]
width = {SIZE}
height = {SIZE}
pixel_pitch_um = {kernels["INS-98301_PIXEL_SIZE"][0]}
focal_length_mm = {focal_mm!r}
aperture_mm = {kernels["INS-98301_APERTURE_DIAMETER"][0]}
psf_sigma_px = {PSF_SIGMA_PX}
distortion = "opencv"
distortion_coefficients = {numbers(opencv)}
position_m = {numbers(frame.camera, 1e3)}
velocity_m_s = {numbers(frame.velocity, 1e3)}
orientation = {numbers(quaternion_of(frame.attitude if attitude is None else attitude))}
"""
    for name, code in bodies.items():
        text += f"""[[body]]
name = "{name}"
shape = "ellipsoid"
radii_m = {numbers(kernels[f"BODY{code}_RADII"], 1e3)}
position_m = {numbers(frame.places[code], 1e3)}
orientation = {numbers(quaternion_of(frame.axes[code]))}
"""
        text += 'material = "lambert"\nalbedo = 1\n' if white else f'material = "{name}"\n'
    return text + f"""[[band]]
from_nm = {RESPONSE[0][0]}
to_nm = {RESPONSE[-1][0]}
transmission = {[list(p) for p in RESPONSE]}
"""


class SunInBand:
    """Irradiance of the Sun at 1 au: in the band, W/m2, and at the pivot wavelength, erg s-1 cm-2 A-1 (ASTM E490)."""

    def __init__(self):
        table = np.loadtxt(case_files.data_file("spectra/E490_00a_AM0.csv"), delimiter=",", skiprows=2)
        um = np.arange(RESPONSE[0][0] + 0.5, RESPONSE[-1][0]) * 1e-3
        response = np.interp(um * 1e3, *zip(*RESPONSE))
        light = np.interp(um, table[:, 0], table[:, 1])
        self.band_w_m2 = float((light * response).sum() * 1e-3)
        self.pivot = 0.1 * float(np.interp(PIVOT_UM, table[:, 0], table[:, 1]))
        # Pivot wavelength of a photon counter: the square root of int R dl / int R l^-2 dl, R the response to energy.
        self.pivot_of_response_um = float(np.sqrt(response.sum() / (response / um**2).sum()))


def dn_per_radiance(frame, sun):
    """Numbers of the calibrated frame per W m-2 sr-1 in the band, for light with the Sun's spectrum: by RSOLAR, DN per second over
    erg s-1 cm-2 A-1 sr-1 at the pivot wavelength."""
    return sun.pivot / sun.band_w_m2 * frame.header["RSOLAR"] * frame.header["EXPTIME"]


def from_support_data(isd, velocity):
    """Limb and terminator of Io in the scene's pixels from the support data that USGS ISIS made of the frame: other pointing and
    position kernels, other code, the same instants. Returns closed curves of points."""
    to_instrument = (np.array(isd["instrument_pointing"]["constant_rotation"]).reshape(3, 3) @
                     rotation_of(isd["instrument_pointing"]["quaternions"][0]))
    body = rotation_of(isd["body_rotation"]["quaternions"][0])  # from J2000
    camera = np.array(isd["instrument_position"]["positions"][0])
    sun = np.array(isd["sun_position"]["positions"][0])
    radii = np.array(isd["naif_keywords"]["BODY501_RADII"])
    # On the unit sphere that the ellipsoid is scaled to: circles of points whose normals are at right angles to the direction there.
    curves = {}
    for name, place in (("limb", camera), ("terminator", sun)):
        scaled = (body @ place) / radii
        distance = np.linalg.norm(scaled)
        axis = scaled / distance
        side = np.cross(axis, [0.3, 0.5, 0.8])
        side /= np.linalg.norm(side)
        angle = np.linspace(0, 2 * np.pi, 3601)
        circle = np.outer(np.cos(angle), side) + np.outer(np.sin(angle), np.cross(axis, side))
        height = 1 / distance
        points = (axis * height + np.sqrt(1 - height**2) * circle) * radii @ body
        sight = points - camera
        normals = (points @ body.T) / radii**2 @ body
        front = np.einsum("ij,ij->i", normals, -sight) > -1e-12 if name == "terminator" else np.ones(len(points), bool)
        curves[name] = project(sight, to_instrument, velocity, isd)[front]
    return curves


def project(sight, to_instrument, velocity, isd):
    """Pixels (x right, y down in the scene's picture) of directions, with aberration and the lens of the support data."""
    unit = sight / np.linalg.norm(sight, axis=1)[:, None]
    speed = np.linalg.norm(velocity) / SPEED_OF_LIGHT_KM_S
    ahead = velocity / np.linalg.norm(velocity)
    gamma, along = 1 / math.sqrt(1 - speed**2), unit @ ahead
    unit = ((unit - np.outer(along, ahead)) / gamma + np.outer(along + speed, ahead)) / (1 + speed * along)[:, None]
    p = unit @ to_instrument.T
    keys = isd["naif_keywords"]
    focal, em = keys["INS-98301_OOC_FOCAL_LENGTH"], keys["INS-98301_OOC_EM"]
    x, y = focal * p[:, 0] / -p[:, 2], focal * p[:, 1] / -p[:, 2]
    factor = 1 + em[0] * (x**2 + y**2) + em[1] * y + em[2] * x
    column = 511.5 + keys["INS-98301_OOC_KMAT"][0] * x * factor
    row = 511.5 + keys["INS-98301_OOC_KMAT"][3] * y * factor
    return np.stack([column, SIZE - 1 - row], axis=1)


def bilinear(image, x, y):
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - x0, y - y0
    return ((1 - fy) * ((1 - fx) * image[y0, x0] + fx * image[y0, x0 + 1]) +
            fy * ((1 - fx) * image[y0 + 1, x0] + fx * image[y0 + 1, x0 + 1]))


def along_curve(curve, centre, angles):
    """Distance of a curve about `centre` at each angle."""
    offset = curve - centre
    angle, distance = np.arctan2(offset[:, 1], offset[:, 0]), np.hypot(offset[:, 0], offset[:, 1])
    order = np.argsort(angle)
    return np.interp(angles, angle[order], distance[order], period=2 * np.pi)


def fitted_shift(angles, differences):
    """Shift (right, down) of a limb by its differences along the radius, and the largest rest."""
    model = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    fit = np.linalg.lstsq(model, differences, rcond=None)[0]
    return fit, float(np.abs(differences - model @ fit).max())


def sub_points(layers, radii_km):
    """Sub-spacecraft and sub-solar point from the layers of the rendered picture alone: latitudes, longitudes, angles, range."""
    seen = layers["body"] == 1
    latitude, longitude = np.radians(layers["latitude_deg"][seen]), np.radians(layers["longitude_deg"][seen])
    direction = np.stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)], axis=1)
    points = direction / np.linalg.norm(direction / radii_km, axis=1)[:, None]
    normals = points / radii_km**2
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    sun = np.linalg.lstsq(normals, np.cos(np.radians(layers["incidence_deg"][seen])), rcond=None)[0]
    # cos e = n (c - p) / |c - p|: linear in the camera's place c, as the range is known.
    towards = np.cos(np.radians(layers["emission_deg"][seen])) * layers["range_m"][seen] * 1e-3 + (normals * points).sum(axis=1)
    camera = np.linalg.lstsq(normals, towards, rcond=None)[0]
    return latitude_longitude(camera), latitude_longitude(sun)


def planetshine_by_quadrature(frame, layers, chosen, turn, radii_km, jupiter_km, jupiter_axes, sun_w_m2):
    """Radiance of a white Lambert Io under a white Lambert Jupiter at the chosen pixels: the sunlit facets of Jupiter that each
    sees, summed up. `turn`: from Io's axes to J2000; `sun_w_m2`: irradiance at Io."""
    u, v = np.meshgrid((np.arange(300) + 0.5) / 300 * 2 - 1, (np.arange(600) + 0.5) / 600 * 2 * np.pi)
    ball = np.stack([np.sqrt(1 - u**2) * np.cos(v), np.sqrt(1 - u**2) * np.sin(v), u], axis=-1).reshape(-1, 3)
    # An area element of the unit sphere becomes det(A) |A^-1 n| of one of the ellipsoid.
    normals = ball / jupiter_km
    area = np.prod(jupiter_km) * np.linalg.norm(normals, axis=1) * 4 * np.pi / len(ball)
    normals = (normals / np.linalg.norm(normals, axis=1)[:, None]) @ jupiter_axes.T
    places = (ball * jupiter_km) @ jupiter_axes.T + frame.jupiter
    sun = frame.sun - frame.jupiter
    lit = normals @ (sun / np.linalg.norm(sun))
    kept = (lit > 0) & (np.einsum("ij,ij->i", normals, -places) > -radii_km[0])
    places, normals, power = places[kept], normals[kept], (lit * area)[kept] / math.pi
    latitude, longitude = np.radians(layers["latitude_deg"][chosen]), np.radians(layers["longitude_deg"][chosen])
    direction = np.stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)], axis=1)
    body = direction / np.linalg.norm(direction / radii_km, axis=1)[:, None]
    own = body / radii_km**2
    out = []
    for point, normal in zip(body @ turn.T, own / np.linalg.norm(own, axis=1)[:, None] @ turn.T):
        way = places - point
        distance = np.linalg.norm(way, axis=1)
        out.append((power * np.maximum(-(normals * way).sum(axis=1), 0) * np.maximum(way @ normal, 0) / distance**4).sum())
    return sun_w_m2 * (np.linalg.norm(frame.sun) / np.linalg.norm(sun))**2 * np.array(out) / math.pi


def limb_and_terminator(image, centre, limb, terminator, sunward, clip):
    """Distances from `centre` at which an image has its limb and its terminator, with their angles: half of the level inside the lit
    limb; where the light, extrapolated down, meets the level of the night side."""
    image = np.minimum(image, clip)
    angles = np.radians(np.arange(-75, 75.5, 1)) + sunward
    steps = np.arange(-12, 6.01, 0.05)
    limb_at = np.full(len(angles), np.nan)
    for i, (angle, expected) in enumerate(zip(angles, along_curve(limb, centre, angles))):
        radii = expected + steps
        line = bilinear(image, centre[0] + radii * math.cos(angle), centre[1] + radii * math.sin(angle))
        inside = line[(steps > -6) & (steps < -3)].mean()
        found = np.nonzero((line[:-1] >= inside / 2) & (line[1:] < inside / 2))[0]
        if len(found):
            k = found[-1]
            limb_at[i] = radii[k] + 0.05 * (line[k] - inside / 2) / (line[k] - line[k + 1])
    angles_inside = np.radians(np.arange(-50, 50.5, 1)) + sunward
    # Away from Sun and limb: the night. Towards the Sun the light grows by the cosine of the incidence.
    terminator_at = np.full(len(angles_inside), np.nan)
    for i, (angle, expected) in enumerate(zip(angles_inside, along_curve(terminator, centre, angles_inside))):
        radii = expected + np.arange(-30, 30.01, 1.0)
        line = bilinear(image, centre[0] + radii * math.cos(angle), centre[1] + radii * math.sin(angle))
        night = line[:15].mean()
        lit = (np.arange(-30, 30.01, 1.0) > 4) & (np.arange(-30, 30.01, 1.0) < 16)
        slope, start = np.polyfit(radii[lit], line[lit] - night, 1)
        terminator_at[i] = -start / slope
    return angles, limb_at, terminator_at


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("obscura", type=pathlib.Path)
    parser.add_argument("--frame", type=pathlib.Path)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--output", type=pathlib.Path)
    parser.add_argument("--scene", type=pathlib.Path, help="write the scene file here too")
    parser.add_argument("--json", type=pathlib.Path, help="write the figures here")
    options = parser.parse_args()
    flight = case_files.data_file("flight_nh_lorri")
    header, images = case_files.read_fits(flight / "lor_0034974380_0x630_sci_1_cropped.fit")
    frame = Frame(header)
    kernels = text_kernel(flight / "kernels/pck00010.tpc", flight / "kernels/nh_lorri_v201.ti")
    frame.turn_bodies(kernels)
    isd = json.loads((flight / "nhlorri_isd.json").read_text())
    report = Report()
    temporary = tempfile.TemporaryDirectory(prefix="obscura-io-lorri-")
    folder = pathlib.Path(temporary.name)
    render = case_files.renderer(options.obscura, folder)

    text = scene_text(frame, kernels)
    if options.scene:
        options.scene.write_text(text)
    layers = render("io", text, "--layers", "--samples", options.samples, "--truth-table", folder / "truth.csv")
    truth = list(csv.DictReader((folder / "truth.csv").read_text().splitlines()))
    radii_km, jupiter_km = np.array(kernels["BODY501_RADII"]), np.array(kernels["BODY599_RADII"])

    # Geometry against the header.
    body = frame.axes[501]
    published = {"sub-spacecraft": (header["SPCTSCLA"], header["SPCTSCLO"]), "sub-solar": (header["SPCTSOLA"], header["SPCTSOLO"])}
    of_layers = dict(zip(published, sub_points(layers, radii_km)))
    mission = [flight / "kernels" / name for name in ("naif0012.tls", "pck00010.tpc", "lor_0034974380_0x630_sci_1_0.xsp",
                                                      "lor_0034974380_0x630_sci_1_1.xsp")]
    place = json.loads(case_files.run(options.obscura, "ephemeris", *mission, "--target", "IO", "--observer", "-98", "--see", "astrometric",
                                      "--time", header["SPCUTCAL"] + "Z", "--json"))["places"][0]
    of_kernels = {"sub-spacecraft": place["below_observer_deg"][::-1], "sub-solar": place["below_sun_deg"][::-1]}
    for name, vector in (("sub-spacecraft", frame.camera), ("sub-solar", frame.sun)):
        computed = latitude_longitude(body.T @ vector)
        for how, found in (("by the header's vectors", computed), ("by the mission's kernels", of_kernels[name]),
                           ("in the rendered picture", of_layers[name])):
            off = max(abs(found[0] - published[name][0]), abs((found[1] - published[name][1] + 180) % 360 - 180))
            report.add(f"{name} point {how}", f"{found[0]:.4f}, {found[1]:.4f} deg",
                       f"header {published[name][0]:.4f}, {published[name][1]:.4f} deg", off, 0.01, "deg")

    # Limb and terminator against the support data of ISIS.
    curves = from_support_data(isd, frame.velocity)
    centre = curves["limb"].mean(axis=0)
    terminator_middle = curves["terminator"].mean(axis=0)
    sunward = math.atan2(terminator_middle[1] - centre[1], terminator_middle[0] - centre[0])
    radiance = layers[""]
    sun = SunInBand()
    distance_au = np.linalg.norm(frame.sun) / 149597870.7
    angles, limb_at, _ = limb_and_terminator(radiance, centre, curves["limb"], curves["terminator"], sunward, np.inf)
    off = limb_at - along_curve(curves["limb"], centre, angles)
    fit, _ = fitted_shift(angles, off)
    rms = float(np.sqrt((off**2).mean()))
    report.add("lit limb of the rendered picture", f"rms difference {rms:.2f}, largest {np.abs(off).max():.2f} px",
               f"ISIS's support data (shift {fit[0]:+.2f}, {fit[1]:+.2f} px)", rms, 0.5, "px")
    for curve in ("limb", "terminator"):
        points = np.array([[float(row["x_px"]), float(row["y_px"])] for row in truth if row["kind"] == curve and row["name"] == "io"])
        off = np.array([np.hypot(*(curves[curve] - point).T).min() for point in points])
        report.add(f"{curve} in the frame's truth table", f"{len(points)} points, largest difference {off.max():.2f} px", "the same",
                   float(off.max()), 0.5, "px")

    # Planetshine against a sum over Jupiter's facets.
    white = render("white", scene_text(frame, kernels, white=True), "--layers", "--samples", options.samples)
    sun_w_m2 = sun.band_w_m2 / distance_au**2
    normals = np.stack([layers[f"normal.{axis}"] for axis in "xyz"], axis=-1)
    with np.errstate(invalid="ignore"):
        night = ((layers["body"] == 1) & (layers["incidence_deg"] > 95) & (layers["emission_deg"] < 75) &
                 (normals @ (frame.jupiter / np.linalg.norm(frame.jupiter)) > 0.2))
    chosen = np.zeros_like(night)
    chosen.flat[np.flatnonzero(night)[::max(1, night.sum() // 200)]] = True
    expected = planetshine_by_quadrature(frame, white, chosen, body, radii_km, jupiter_km,
                                         frame.axes[599], sun_w_m2)
    ratio = float(white[""][chosen].mean() / expected.mean())
    report.add("planetshine, white Io and white Jupiter", f"{ratio:.4f} of the sum over Jupiter's facets",
               f"{chosen.sum()} pixels of the night side", abs(ratio - 1), 0.02, "")

    # Levels in the units of the calibrated frame.
    to_dn = dn_per_radiance(frame, sun)
    dn = radiance * to_dn
    night_dn, day_dn = float(dn[night].mean()), float(np.percentile(dn, 99.9))
    report.say("night side, mean", f"{night_dn:.0f} DN", f"I/F {night_dn / to_dn * math.pi / sun.band_w_m2 * distance_au**2:.5f}")
    report.say("brightest part of the day side", f"{day_dn:.0f} DN", "the frame is of 12 bits: it was exposed for the night side")
    report.add("pivot wavelength of the band", f"{1e3 * sun.pivot_of_response_um:.1f} nm", f"header {1e3 * PIVOT_UM:.1f} nm",
               abs(1e3 * (sun.pivot_of_response_um - PIVOT_UM)), 6, "nm")
    real, error = images[""][1:], images["LORRI Error image"][1:]
    sound = error > 0
    report.say("sky of the flight frame, the pixels at hand",
               f"mean {real[sound].mean():.2f}, standard deviation {real[sound].std():.2f} DN",
               f"header's error estimate {error[sound].mean():.2f} DN; rendered there: {dn[-3:, :25].mean():.2f} DN")

    compared = None
    if options.frame:
        compared = against_flight_frame(report, options.frame, dn, night, centre, curves, sunward)
    else:
        report.say("limb, terminator and night side of the flight frame", "not compared",
                   "the copy at hand is cut to its first 25 x 3 pixels: sky")
    report.print()
    if options.json:
        options.json.write_text(json.dumps(report.figures, indent=1))
    if options.output:
        pictures(options.output, dn, night_dn, day_dn, real, compared)
        report.into_page(options.output / "io-lorri.md")
    sys.exit(0 if report.good else 1)


def against_flight_frame(report, file, dn, night, centre, curves, sunward):
    """The whole flight frame, real beside rendered. Returns it with its first row on top."""
    flight = case_files.read_fits(file)[1][""]
    if flight.shape != (SIZE, SIZE):
        sys.exit(f"{file}: {flight.shape[1]} x {flight.shape[0]} pixels: wanted are {SIZE} x {SIZE}")
    flight = flight[::-1]
    clip = min(0.9 * np.percentile(flight, 99.95), 3500.0)
    angles, *ours = limb_and_terminator(dn, centre, curves["limb"], curves["terminator"], sunward, clip)
    _, *theirs = limb_and_terminator(flight, centre, curves["limb"], curves["terminator"], sunward, clip)
    sound = np.isfinite(ours[0]) & np.isfinite(theirs[0])
    if sound.sum() < 20:
        sys.exit(f"{file}: has no limb where the header puts it")
    difference = theirs[0][sound] - ours[0][sound]
    (right, down), rest = fitted_shift(angles[sound], difference)
    off = float(np.median(np.abs(difference)))
    report.add("limb of the flight frame", f"median difference {off:.2f} px",
               f"shift {right:+.2f}, {down:+.2f}, rest {rest:.2f} px", off, 0.5, "px")
    report.figures["shift_px"] = [right, down]
    difference = theirs[1] - ours[1]
    report.add("terminator of the flight frame", f"median difference {np.median(difference):+.2f} px", "seen from the centre",
               float(abs(np.median(difference))), 0.5, "px")
    factor = float(np.median(flight[night]) / np.median(dn[night]))
    report.add("night side of the flight frame", f"{factor:.2f} of the rendered", "medians", max(factor, 1 / factor), 1.3, "")
    report.figures["night_factor"] = factor
    return flight


def pictures(folder, dn, night_dn, day_dn, real, flight):
    window = np.s_[430:770, 310:650]
    panels = [case_files.grey(dn[window], 0, day_dn), case_files.grey(dn[window], 0, 3 * night_dn)]
    case_files.write_png(folder / "io-lorri.png", case_files.beside(*panels))
    noise = np.random.Generator(np.random.Philox(1)).normal(0, 1.38, (3, 25))
    corner = [case_files.enlarged(case_files.grey(v, -6, 6), 12) for v in (real, (dn[-3:, :25] + noise)[1:], real - dn[-3:, :25][1:])]
    case_files.write_png(folder / "io-lorri-sky.png", case_files.beside(*corner))
    if flight is not None:
        panels = [case_files.grey(v[window], 0, 3 * night_dn) for v in (flight, dn)]
        panels.append(case_files.grey((flight - dn)[window], -night_dn, night_dn))
        case_files.write_png(folder / "io-lorri-flight.png", case_files.beside(*panels))


if __name__ == "__main__":
    main()
