#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes scene.toml, stars.csv and camera.csv: a camera that turns to and fro at 1 deg/s about an axis across its boresight for
SECONDS, before stars and a body that turns at 1 deg/s too, lit from behind the camera: ahead_scene.py SECONDS

To and fro, so that the same stars and the body stay in a field of 1.5 degrees.
"""
import math
import pathlib
import sys

PIXEL_RAD = 2e-4
TURN_DEG = 0.3  # to either side
RATE_DEG_S = 1
DISTANCE_M = 1e5
RADIUS_PX = 12
STARS = [(-44, -34, -1.5), (42, 32, -1.2), (-38, 30, -1.0), (45, -28, -1.4), (4, -38, -1.1), (-3, 37, -1.3)]  # px right, px down, V

# The camera at (-DISTANCE_M, 0, 0) looks along x; right is -y, down is -z. Its axes at rest as a quaternion.
REST = (0.5, -0.5, 0.5, -0.5)


def product(p, q):
    (a, b, c, d), (e, f, g, h) = p, q
    return (a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e)


with open("camera.csv", "w", encoding="ascii") as table:
    table.write("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n")
    time_s, side = 0.0, -1
    while time_s <= float(sys.argv[1]):
        # About an axis between the image's own: both coordinates move.
        half = math.radians(side * TURN_DEG) / 2
        turned = product(REST, (math.cos(half), 0.8 * math.sin(half), 0.6 * math.sin(half), 0))
        table.write(f"{time_s:.9f},{-DISTANCE_M},0,0," + ",".join(f"{v:.15f}" for v in turned) + "\n")
        time_s += 2 * TURN_DEG / RATE_DEG_S
        side = -side
with open("stars.csv", "w", encoding="ascii") as table:
    table.write("ra_deg,dec_deg,v_mag,b_v\n")
    for right, down, v_mag in STARS:
        x, y, z = 1, -right * PIXEL_RAD, -down * PIXEL_RAD
        table.write(f"{math.degrees(math.atan2(y, x)) % 360:.9f},{math.degrees(math.atan2(z, math.hypot(x, y))):.9f},{v_mag},0.6\n")
radius_m = RADIUS_PX * PIXEL_RAD * DISTANCE_M
pathlib.Path("scene.toml").write_text(f"""name = "turning"
[sun]
direction = [-1, 0, 0]
distance_au = 2
[stars]
catalogue = "stars.csv"
[camera]
pixel_pitch_um = 5.5
focal_length_mm = {5.5e-3 / PIXEL_RAD}
aperture_mm = 50
psf_sigma_px = 0.7
trajectory = "camera.csv"
[[body]]
name = "moonlet"
shape = "ellipsoid"
radii_m = [{radius_m}, {radius_m * 0.95}, {radius_m * 0.9}]
material = "lommel-seeliger"
albedo = 0.01
spin_axis = [0, 0, 1]
spin_rate_deg_per_s = 1
""", encoding="ascii")
