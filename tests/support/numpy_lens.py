# SPDX-License-Identifier: Apache-2.0
"""Where a camera has points, directions and outlines of ellipsoids: pinhole, aberration (Lorentz transform of the direction) and
distortion by OpenCV's formula, with nothing of the program's."""
import numpy as np

LIGHT_M_S = 299_792_458.0


def rotation(q):
    """Matrix from own axes to those that the unit quaternion w, x, y, z refers to."""
    w, x, y, z = np.asarray(q) / np.linalg.norm(q)
    return np.array(((w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
                     (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
                     (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z)))


def quaternion(axes):
    """w, x, y, z of a rotation matrix without half a turn."""
    w = np.sqrt(1 + np.trace(axes)) / 2
    return np.array((w, *((axes[(i + 2) % 3, (i + 1) % 3] - axes[(i + 1) % 3, (i + 2) % 3]) / (4 * w) for i in range(3))))


class Lens:
    """Camera at a pose, right, down, ahead; moving, with a distorted lens."""

    def __init__(self, position_m, q, velocity_m_s, focal_px, distortion, size):
        self.position_m = np.asarray(position_m)
        self.axes = rotation(q)
        self.beta = np.asarray(velocity_m_s) / LIGHT_M_S
        self.focal_px = focal_px
        self.distortion = distortion  # OpenCV: k1 k2 p1 p2 k3
        self.centre = (np.array(size) - 1) / 2

    def of_directions(self, inertial):
        """Image points of directions at rest, n x 3."""
        d = inertial / np.linalg.norm(inertial, axis=-1, keepdims=True)
        gamma = 1 / np.sqrt(1 - self.beta @ self.beta)
        along = d @ self.beta
        # A photon comes along -d; its direction in the frame of the camera.
        seen = d / gamma + self.beta * (1 + gamma / (1 + gamma) * along)[..., None]
        x, y, z = (seen @ self.axes).T
        u, v = x / z, y / z
        k1, k2, p1, p2, k3 = self.distortion
        r2 = u * u + v * v
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return np.stack((self.focal_px * (u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u * u)) + self.centre[0],
                         self.focal_px * (v * radial + p1 * (r2 + 2 * v * v) + 2 * p2 * u * v) + self.centre[1]), axis=-1)

    def of_points(self, inertial_m):
        return self.of_directions(np.asarray(inertial_m) - self.position_m)

    def limb(self, position_m, q, radii_m, points=5000):
        """Image of the outline of an ellipsoid: of the points whose tangent planes hold the camera."""
        axes = rotation(q)
        camera = (self.position_m - position_m) @ axes / radii_m
        # The tangent points s of the unit sphere are the circle s . camera = 1.
        normal = camera / np.linalg.norm(camera)
        side = np.linalg.svd(normal[None])[2][1:]
        a = np.linspace(0, 2 * np.pi, points, endpoint=False)[:, None]
        circle = np.sqrt(1 - 1 / (camera @ camera)) * (np.cos(a) * side[0] + np.sin(a) * side[1]) + camera / (camera @ camera)
        return self.of_points(circle * radii_m @ axes.T + position_m)


def distances(points, curve):
    """From each point to the nearest of a closed polygon."""
    a, b = curve, np.roll(curve, -1, axis=0)
    out = []
    for p in points:
        near = np.argmin(((a - p) ** 2).sum(axis=1))
        best = np.inf
        for k in (near - 1, near):
            edge = b[k] - a[k]
            t = np.clip((p - a[k]) @ edge / (edge @ edge), 0, 1)
            best = min(best, np.linalg.norm(a[k] + t * edge - p))
        out.append(best)
    return np.array(out)


def inside(points, polygon):
    """Whether each point is inside of a closed polygon: crossings of the line to the right."""
    x, y = polygon.T
    x1, y1 = np.roll(x, -1), np.roll(y, -1)
    answers = []
    for px, py in points:
        crosses = (y > py) != (y1 > py)
        with np.errstate(divide="ignore", invalid="ignore"):
            answers.append(np.count_nonzero(crosses & (px < x + (py - y) / (y1 - y) * (x1 - x))) % 2 == 1)
    return np.array(answers)
