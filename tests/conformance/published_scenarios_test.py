#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Light and geometry of scenes that the published client's commands build, beside their formulas.

Usage: published_scenarios_test.py OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed, 77 without numpy.
"""
import math
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from client_checks import obscura  # noqa: E402  skips the test without numpy
import numpy  # noqa: E402
from published_client.server import Checks, Server  # noqa: E402

AU, SUN_RADIUS = 149597870700.0, 695.7e6
test = Checks()


def start(client, size, fov_deg):
    """An empty scene, the camera at the origin: looks along -z, y is up."""
    client.reset()
    client.setConventions(0, 0)
    client.setImageSize(*size)
    client.setCameraFOVDeg(*fov_deg)
    client.setPSF(0, 0, b"", -1, -1, 0)
    client.setNbSamplesPerPixel(16)
    client.enableRaytracing(True)
    client.enableIrradianceMode(False)
    client.setCompressionLevel(0)


def add_ball(client, name, radius, place, brdf="mate", parameters=1.0):
    client.createBRDF(brdf, f"{brdf}.brdf", parameters)
    client.createShape(name, "sphere.shp", {"radius": radius})
    client.createBody(name, name, brdf, [])
    client.setObjectPosition(name, place)


def add_sun(client, place, power=math.pi * AU**2):
    add_ball(client, "sun", SUN_RADIUS, place, "sun", {})
    client.setSunPower([power] * 4)


def centroid(picture):
    """Column and row, 0.5 at the centre of the first pixel."""
    rows, columns = numpy.indices(picture.shape)
    light = picture.astype(float)
    return (light * columns).sum() / light.sum() + 0.5, (light * rows).sum() / light.sum() + 0.5


def attitude(look, up):
    """Quaternion x, y, z, w of a camera that looks along -z of its own frame, y up."""
    z = -numpy.asarray(look, float) / numpy.linalg.norm(look)
    x = numpy.cross(up, z)
    x /= numpy.linalg.norm(x)
    m = numpy.column_stack([x, numpy.cross(z, x), z])
    w = math.sqrt(max(0.0, 1 + numpy.trace(m))) / 2
    if w < 1e-3:
        raise ValueError("half a turn")
    return [(m[2, 1] - m[1, 2]) / (4 * w), (m[0, 2] - m[2, 0]) / (4 * w), (m[1, 0] - m[0, 1]) / (4 * w), w]


def same_turn(one, other):
    """Whether two quaternions are the same rotation."""
    return min(numpy.abs(numpy.subtract(one, other)).max(), numpy.abs(numpy.add(one, other)).max()) < 1e-12


def overlap(a, b, distance):
    """Part of a disc of radius a that one of radius b covers."""
    if distance >= a + b:
        return 0.0
    if distance <= abs(a - b):
        return min(1.0, (b / a)**2)
    first = math.acos((distance**2 + a**2 - b**2) / (2 * distance * a))
    second = math.acos((distance**2 + b**2 - a**2) / (2 * distance * b))
    return (a**2 * (first - math.sin(2 * first) / 2) + b**2 * (second - math.sin(2 * second) / 2)) / (math.pi * a**2)


def gaussian(samples, sigma):
    axis = numpy.arange(samples) - (samples - 1) / 2
    kernel = numpy.exp(-(axis[:, None]**2 + axis[None, :]**2) / (2 * sigma**2))
    return (kernel / kernel.sum()).astype("<f4")


def check_stars(client, root):
    """Stars near the pole towards which the default camera looks, each through three point spread functions."""
    start(client, (511, 511), (5, 5))
    client.enableIrradianceMode(True)
    focal = 255.5 / math.tan(math.radians(2.5))
    light = [1e-9, 2e-9, 6e-9, 5e-10]
    for x_deg, y_deg in ((0.31, 1.17), (-2.1, 0.75), (1.503, -2.2)):
        star = numpy.array([math.tan(math.radians(x_deg)), math.tan(math.radians(y_deg)), -1])
        star /= numpy.linalg.norm(star)
        (root / "pole.txt").write_text("1\n" + " ".join(repr(float(value)) for value in (*star, *light)) + "\n")
        client.setBackground("pole.txt")
        column, row = 255.5 + focal * math.tan(math.radians(x_deg)), 255.5 - focal * math.tan(math.radians(y_deg))
        for samples, support in ((9, -1), (45, 9.0), (90, 9.0)):
            kernel = gaussian(samples, samples / 9)
            client.setPSF(samples, samples, kernel.tobytes(), support, support, 0)
            client.render()
            picture = client.getImageGray32F()
            got = centroid(picture)
            what = f"star at {x_deg}, {y_deg} deg, kernel of {samples} samples"
            test.near(f"column of a {what}", got[0], column, 0.02)
            test.near(f"row of a {what}", got[1], row, 0.02)
            test.near(f"light of a {what}", float(picture.sum()) / 3e-9, 1, 0.01)
    colours = client.getImage().reshape(-1, 4).sum(axis=0)
    test.check("channels of a star", numpy.allclose(colours, light, rtol=0.01), colours)
    client.setStarThreshold(7e-9)
    client.render()
    test.check("a star below the threshold is dark", float(client.getImageGray32F().max()) == 0)
    client.setStarThreshold(5e-9)
    client.render()
    test.check("one that exceeds it in a channel is not", float(client.getImageGray32F().max()) > 0)
    client.setStarThreshold(0)


def check_eclipse(client):
    """The Sun at the origin; the camera where the Moon's surface faces it; the Earth between them goes aside."""
    moon = numpy.array([1.5e11, 0, 0])
    moon_radius, earth_radius, earth_distance = 1737.4e3, 6371e3, 3.844e8
    camera = moon - [moon_radius, 0, 0]
    start(client, (128, 128), (1, 1))
    client.enableIrradianceMode(True)
    add_sun(client, [0, 0, 0])
    add_ball(client, "moon", moon_radius, moon)
    add_ball(client, "earth", earth_radius, [0, 0, 0])
    client.setObjectPosition("camera", camera)
    client.setObjectAttitude("camera", attitude([-1, 0, 0], [0, 0, 1]))
    distance = float(camera[0])
    sun_angle = math.asin(SUN_RADIUS / distance)
    whole = math.pi * AU**2 / distance**2
    results = []
    for share in (3.0, 0.9, 0.5, 0.1, -0.3, -0.7):
        # `share` solar radii between the Sun's centre and the Earth's limb.
        range_m = earth_distance - moon_radius
        angle = math.asin(earth_radius / range_m) + share * sun_angle
        client.setObjectPosition("earth", camera + range_m * numpy.array([-math.cos(angle), 0, -math.sin(angle)]))
        client.render()
        # Discs on the sphere, seen flat about the Sun: its radius is 0.27 degrees, the Earth's limb is nearly straight.
        seen = 1 - overlap(sun_angle, math.asin(earth_radius / range_m), angle)
        got = float(client.getImageGray32F().astype(float).sum()) / whole
        results.append((share, got))
        test.near(f"light of the Sun beside the Earth's limb at {share} radii, beside {seen:.4f}", got, seen, 0.005 * max(seen, 0.2))
    # The ground itself, from above: as much light as there is Sun.
    client.setObjectPosition("camera", camera - [1000, 0, 0])
    client.setObjectAttitude("camera", attitude([1, 0, 0], [0, 0, 1]))
    client.setImageSize(16, 16)
    client.setNbSamplesPerPixel(64)
    client.enableIrradianceMode(False)
    for share in (0.5, -0.3):
        range_m = earth_distance - moon_radius
        angle = math.asin(earth_radius / range_m) + share * sun_angle
        client.setObjectPosition("earth", camera + range_m * numpy.array([-math.cos(angle), 0, -math.sin(angle)]))
        client.render()
        seen = 1 - overlap(sun_angle, math.asin(earth_radius / range_m), angle)
        wanted = seen * (AU / distance)**2
        test.near(f"light of the ground below it at {share} radii", float(client.getImageGray32F().mean()) / wanted, 1, 0.005)


def check_balls(client):
    start(client, (129, 129), (20, 20))
    add_sun(client, [0, 0, AU])
    add_ball(client, "ball", 1.0, [0, 0, -10])
    client.render()
    picture = client.getImage()
    test.near("radiance of a white ball, the Sun in zenith", float(picture[64, 64, 1]), (AU / (AU + 9))**2, 0.01)
    test.check("of which 8 bits are white", int(client.getImageGray8()[64, 64]) >= 253, client.getImageGray8()[64, 64])
    test.check("gray is the mean of three channels", numpy.allclose(client.getImageGray32F(), picture[..., :3].mean(axis=2),
                                                                    rtol=1e-6))
    rgba = client.getImageRGBA8()
    test.check("8 bits are rounded", numpy.abs(rgba[..., :3].astype(float) - picture[..., :3].clip(0, 1) * 255).max() <= 0.501)
    depth = client.getDepthMap()
    hit = numpy.isfinite(depth)
    radius = 64.5 / math.tan(math.radians(10)) * math.tan(math.asin(0.1))
    test.near("radius of the ball", math.sqrt(hit.sum() / math.pi), radius, 0.1)
    at = centroid(hit)
    test.near("column of its centre", at[0], 64.5, 0.02)
    test.near("row of its centre", at[1], 64.5, 0.02)
    test.near("range of its nearest point", float(depth[64, 64]), 9, 1e-6)
    test.check("where nothing is, the range is infinite", math.isinf(depth[0, 0]))
    normals = client.getNormalMap()
    test.check("normal of its nearest point", numpy.allclose(normals[64, 64], [0, 0, 1], atol=1e-4), normals[64, 64])

    start(client, (640, 480), (40, 30))
    client.setNbSamplesPerPixel(4)
    tan = {angle: math.tan(math.radians(angle)) for angle in (10, 15)}
    ball = 1000 * numpy.array([tan[15], -tan[10], -1])
    add_sun(client, -1e8 * ball)  # behind the camera, so that the ball is full
    add_ball(client, "ball", 4.0, ball)
    client.render()
    at = centroid(client.getImageGray32F())
    test.near("column of a ball at 15 deg", at[0], 320 + 879.19 * tan[15], 0.3)
    test.near("row of a ball at 10 deg", at[1], 240 + 895.69 * tan[10], 0.3)

    # The camera's other convention: the same picture by the quaternion times half a turn about x.
    look = attitude([0.02, -0.01, -1], [0.1, 1, 0])
    client.setObjectAttitude("camera", look)
    client.render()
    before = client.getImageGray32F().tobytes()
    client.setConventions(0, 1)
    turned = client.getObjectAttitude("camera")
    x, y, z, w = look
    wanted = numpy.array([w, z, -y, -x])  # look * (1, 0, 0; 0)
    test.check("attitude in the other convention", same_turn(turned, wanted), (turned, wanted))
    client.setObjectAttitude("camera", list(wanted))
    client.render()
    test.check("attitude set in the other convention", client.getImageGray32F().tobytes() == before)
    client.setConventions(1, 0)
    test.check("attitude with the scalar first", same_turn(client.getObjectAttitude("camera"), [w, x, y, z]))


def check_sun(client):
    """A Sun of 0.6 px radius: all its light, however it is spread."""
    start(client, (128, 128), (40, 40))
    client.enableIrradianceMode(True)
    distance = SUN_RADIUS / (0.6 / (64 / math.tan(math.radians(20))))
    add_sun(client, [0.013 * distance, -0.004 * distance, -distance], 3e20)
    for name, kernel in (("none", None), ("gaussian", gaussian(15, 1.5))):
        if kernel is not None:
            client.setPSF(*kernel.shape, kernel.tobytes(), -1, -1, 0)
        client.render()
        total = float(client.getImageGray32F().astype(float).sum())
        test.near(f"light of a small Sun, PSF {name}", total / (3e20 / (distance**2 * (1 + 0.013**2 + 0.004**2))), 1, 0.01)


with tempfile.TemporaryDirectory(prefix="obscura-published-") as temporary:
    with Server(obscura, temporary) as server, server.connect() as client:
        check_balls(client)
        check_sun(client)
        check_stars(client, server.root)
        check_eclipse(client)
test.end()
