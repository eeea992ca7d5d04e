# SPDX-License-Identifier: Apache-2.0
"""Galilean moons where no kernel is at hand: the largest terms of Lieske's theory E5 (Galilean satellite ephemerides E5, Astron.
Astrophys. Suppl. Ser. 129, 205 (1998); coefficients in degrees as Meeus, Astronomical Algorithms, 1998, chapter 44, prints them)."""
import math

import numpy as np

NAMES = {"io": 501, "europa": 502, "ganymede": 503, "callisto": 504}
UNIT_KM = 71398.0  # Jupiter's equatorial radius, the unit of the theory's distances


def positions_km(tdb_s, pole, orbit_pole):
    """Positions from Jupiter's centre, km, J2000 axes, by name. `tdb_s`: TDB seconds from J2000; `pole`: Jupiter's north pole;
    `orbit_pole`: that of its orbit."""
    t = tdb_s / 86400 + 2451545.0 - 2443000.5
    rad = math.radians
    l1, l2 = rad(106.07719 + 203.488955790 * t), rad(175.73161 + 101.374724735 * t)
    l3, l4 = rad(120.55883 + 50.317609207 * t), rad(84.44459 + 21.571071177 * t)
    p2 = rad(154.8663 + 0.04726307 * t)
    p3, p4 = rad(188.1840 + 0.00712734 * t), rad(335.2868 + 0.00184000 * t)
    w1, w2 = rad(312.3346 - 0.13279386 * t), rad(100.4411 - 0.03263064 * t)
    w3, w4 = rad(119.1942 - 0.00717703 * t), rad(322.6186 - 0.00175934 * t)
    psi = rad(316.5182 - 0.00000208 * t)  # node of Jupiter's equator on its orbit
    anomaly = rad(30.23756 + 0.0830925701 * t)  # of Jupiter
    phi = rad(199.6766 + 0.17379190 * t)  # libration
    sin, cos = math.sin, math.cos
    longitude = {
        "io": l1 + rad(0.47259 * sin(2 * (l1 - l2)) - 0.03478 * sin(p3 - p4) + 0.01081 * sin(l2 - 2 * l3 + p3) + 0.00738 * sin(phi) +
                       0.00713 * sin(l2 - 2 * l3 + p2) + 0.00666 * sin(l2 - 2 * l3 + p4) + 0.00445 * sin(l1 - p3)),
        "europa": l2 + rad(1.06476 * sin(2 * (l2 - l3)) + 0.04256 * sin(l1 - 2 * l2 + p3) + 0.03581 * sin(l2 - p3) +
                           0.02395 * sin(l1 - 2 * l2 + p4) + 0.01984 * sin(l2 - p4) - 0.01778 * sin(phi) + 0.01654 * sin(l2 - p2) +
                           0.01334 * sin(l2 - 2 * l3 + p2) + 0.01294 * sin(p3 - p4) - 0.01142 * sin(l2 - l3) - 0.01057 * sin(anomaly)),
        "ganymede": l3 + rad(0.16490 * sin(l3 - p3) + 0.09081 * sin(l3 - p4) - 0.06907 * sin(l2 - l3) + 0.03784 * sin(p3 - p4) +
                             0.01846 * sin(2 * (l3 - l4)) - 0.01340 * sin(anomaly)),
        "callisto": l4 + rad(0.84287 * sin(l4 - p4) + 0.03431 * sin(p4 - p3) - 0.03305 * sin(anomaly) - 0.01862 * sin(l4 - p3)),
    }
    distance = {
        "io": 5.90569 * (1 - 0.0041339 * cos(2 * (l1 - l2))),
        "europa": 9.39657 * (1 + 0.0093848 * cos(l1 - l2)),
        "ganymede": 14.98832 * (1 - 0.0014388 * cos(l3 - p3) - 0.0007917 * cos(l3 - p4) + 0.0006342 * cos(l2 - l3)),
        "callisto": 26.36273 * (1 - 0.0073546 * cos(l4 - p4)),
    }
    # Tangents of the latitudes.
    tangent = {
        "io": 0.0006393 * sin(longitude["io"] - w1) + 0.0001825 * sin(longitude["io"] - w2),
        "europa": 0.0081004 * sin(longitude["europa"] - w2) + 0.0004512 * sin(longitude["europa"] - w3),
        "ganymede": 0.0032402 * sin(longitude["ganymede"] - w3) - 0.0016911 * sin(longitude["ganymede"] - psi),
        "callisto": -0.0076579 * sin(longitude["callisto"] - psi) + 0.0044134 * sin(longitude["callisto"] - w4),
    }
    node = np.cross(orbit_pole, pole)
    node /= np.linalg.norm(node)
    across = np.cross(pole, node)
    out = {}
    for name in NAMES:
        latitude, angle = math.atan(tangent[name]), longitude[name] - psi
        direction = math.cos(latitude) * (math.cos(angle) * node + math.sin(angle) * across) + math.sin(latitude) * np.asarray(pole)
        out[name] = UNIT_KM * distance[name] * direction
    return out
