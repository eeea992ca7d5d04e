# SPDX-License-Identifier: Apache-2.0
"""Rotations and rotation models of the case studies: written apart from the product's, to be held against it."""
import math
import re

import numpy as np

SPEED_OF_LIGHT_KM_S = 299792.458
DAY_S = 86400.0


def rotation_of(quaternion):
    """Rotation matrix of a scalar-first quaternion."""
    w, x, y, z = np.asarray(quaternion, float) / np.linalg.norm(quaternion)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def quaternion_of(matrix):
    """Scalar-first quaternion of a rotation matrix."""
    m = np.asarray(matrix)
    k = np.array([[m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
                  [0, m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
                  [0, 0, m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
                  [0, 0, 0, m[2, 2] - m[0, 0] - m[1, 1]]])
    k = k + np.triu(k, 1).T
    values, vectors = np.linalg.eigh(k)
    q = vectors[:, np.argmax(values)]
    return q if q[0] >= 0 else -q


def latitude_longitude(vector):
    """Planetocentric latitude and east longitude (0 to 360), degrees."""
    return (math.degrees(math.atan2(vector[2], math.hypot(vector[0], vector[1]))),
            math.degrees(math.atan2(vector[1], vector[0])) % 360)


def text_kernel(*files):
    """Numbers of the assignments in text kernels, a list each; later files count more."""
    values = {}
    for file in files:
        for block in re.findall(r"\\begindata(.*?)(?=\\begintext|\Z)", file.read_text("latin-1"), re.S):
            for key, several, single in re.findall(r"^\s*([\w/-]+)\s*=\s*(?:\(([^)]*)\)|(\S+))", block, re.M):
                try:
                    values[key] = [float(t.replace("D", "E")) for t in re.split(r"[\s,]+", (several or single).strip()) if t]
                except ValueError:
                    pass  # text
    return values


def iau_rotation(kernels, body, tdb_s):
    """Rotation from body-fixed to J2000 axes by the model of a text PCK. Archinal et al. 2011, section 2."""
    days, centuries = tdb_s / DAY_S, tdb_s / DAY_S / 36525
    system = kernels.get(f"BODY{body // 100}_NUT_PREC_ANGLES", [])
    angles = np.radians([system[2 * i] + system[2 * i + 1] * centuries for i in range(len(system) // 2)])

    def angle(name, terms, function, time):
        sum_ = np.polyval(kernels[f"BODY{body}_{name}"][::-1], time)
        terms = kernels.get(f"BODY{body}_{terms}", [])
        return math.radians(sum_ + sum(c * function(a) for c, a in zip(terms, angles)))
    right_ascension = angle("POLE_RA", "NUT_PREC_RA", math.sin, centuries)
    declination = angle("POLE_DEC", "NUT_PREC_DEC", math.cos, centuries)
    meridian = angle("PM", "NUT_PREC_PM", math.sin, days)
    pole = np.array([math.cos(declination) * math.cos(right_ascension), math.cos(declination) * math.sin(right_ascension),
                     math.sin(declination)])
    node = np.array([-math.sin(right_ascension), math.cos(right_ascension), 0.0])
    x = math.cos(meridian) * node + math.sin(meridian) * np.cross(pole, node)
    return np.stack([x, np.cross(pole, x), pole], axis=1)
