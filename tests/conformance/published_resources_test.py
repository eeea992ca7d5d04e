#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Elevation models, meshes, textures and saved pictures of the published client's commands, beside what they must be.

Usage: published_resources_test.py OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed, 77 without numpy.
"""
import math
import pathlib
import struct
import sys
import tempfile
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from client_checks import obscura  # noqa: E402  skips the test without numpy
import numpy  # noqa: E402
from obscura_client.png import png  # noqa: E402
from published_client.client import pack  # noqa: E402
from published_client.server import Checks, Server  # noqa: E402

AU = 149597870700.0
test = Checks()
TETRAHEDRON = "v 1 1 1\nv -1 -1 1\nv -1 1 -1\nv 1 -1 -1\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n"


def start(client, fov_deg=20, size=65):
    client.reset()
    client.setConventions(0, 0)
    client.setImageSize(size, size)
    client.setCameraFOVDeg(fov_deg, fov_deg)
    client.setNbSamplesPerPixel(4)
    client.setSunPower([math.pi * AU**2] * 4)
    client.createBRDF("mate", "mate.brdf", 1.0)


def distance(client, origin, direction):
    return client.intersectScene([[*map(float, origin), *map(float, direction)]])[0]


def check_models(client, root):
    """A sphere with a step of heights at the equator; the same data as a plane."""
    heights = numpy.zeros((90, 180), "u1")
    heights[:45] = 100  # m, in the north
    (root / "step.png").write_bytes(png(heights))
    keys = "LINES = 90;\nLINE_SAMPLES = 180;\nA_AXIS_RADIUS = 1000;\nHEIGHTMAP = \"step.png\";\n"
    (root / "step.dem").write_text('TYPE = "SIMPLE_CYLINDRICAL";\n' + keys)
    (root / "plane.dem").write_text('TYPE = "PLANAR";\nMAP_SCALE = 2;\n' + keys.replace("180", "90"))
    (root / "plane.png").write_bytes(png(heights[:, :90].copy()))
    (root / "plane.dem").write_text((root / "plane.dem").read_text().replace("step.png", "plane.png") + "SCALING_FACTOR = 0.5;\n")
    start(client)
    info = client.createSphericalDEM("relief", "step.dem", "mate", "")
    test.check("edges of a model", (info["MINIMUM_LATITUDE"], info["MAXIMUM_LATITUDE"], info["WESTERNMOST_LONGITUDE"],
                                    info["EASTERNMOST_LONGITUDE"], info["A_AXIS_RADIUS"]) == (-90, 90, -180, 180, 1000), info)
    for name, axis, radius in (("north", [0, 0, 1], 1100), ("south", [0, 0, -1], 1000)):
        got = distance(client, 5000 * numpy.array(axis), -numpy.array(axis))
        test.near(f"radius of the {name} pole", 5000 - got, radius, 0.01)
    for longitude in (0, 90, 180):
        axis = numpy.array([math.cos(math.radians(longitude)) * 0.8, math.sin(math.radians(longitude)) * 0.8, 0.6])
        test.near(f"radius at 37 deg north, {longitude} deg", 5000 - distance(client, 5000 * axis, -axis), 1100, 0.05)
    client.createDEM("ground", "plane.dem", "mate", "")
    client.setObjectPosition("ground", [0, 0, -10000])
    for y, height in ((60, 50), (-60, 0)):
        test.near(f"height of the plane at y = {y}", distance(client, [1, y, -5000], [0, 0, -1]), 5000 - height, 0.01)
    (root / "cubes.dem").write_text('TYPE = "CUBEMAP";\nA_AXIS_RADIUS = 1;\nHEIGHTMAP = "step.png";\n')
    test.refused("a private format", "CUBEMAP", lambda: client.createSphericalDEM("relief", "cubes.dem", "mate", ""))
    info = client.createSphericalDEM("moon", "FullMoon.dem", "mate", "Kaguya_MI_refl_b2_750nm_global_128ppd.big")
    test.check("a body stands in for a model that is not public", info["A_AXIS_RADIUS"] == 1737400 and
               any("not public" in line for line in client.log), client.log)


def check_meshes(client, root):
    (root / "tetrahedron.obj").write_text(TETRAHEDRON)
    start(client)
    client.createShape("ball", "sphere.shp", {"radius": 100})
    client.createBody("ball", "ball", "mate", [])
    half = math.sqrt(0.5)
    # One as it is; one twice as large, turned by 90 degrees about z.
    client.loadMultipleMeshes("two", ["tetrahedron.obj"] * 2, [[1000, 0, 0], [2000, 0, 0]],
                              [[0, 0, 0, 1], [0, 0, 2 * half, 2 * half]])
    # The edge from (1, 1, 1) to (-1, -1, 1) is on top: in x = y, after the turn in x = -y.
    test.near("top of a mesh", distance(client, [1000.5, 0.5, 50], [0, 0, -1]), 49, 1e-4)
    test.near("top of one twice as large, turned", distance(client, [2001, -1, 50], [0, 0, -1]), 48, 1e-4)
    test.check("beside the edge it is lower", distance(client, [2001, 1, 50], [0, 0, -1]) > 48.5)
    # On the ball: towards its centre, half a radius of the bounding sphere above the surface.
    client.loadAndProjectMultipleMeshes("rock", ["tetrahedron.obj"], [[0, 0, 500]], [[0, 0, 0, 1]], [0, 0, 0, 1], 0.5)
    test.near("a mesh on a ball", distance(client, [0, 0, 500], [0, 0, -1]), 400 - 0.5 * math.sqrt(3) - 1, 1e-4)
    client.loadAndProjectMultipleMeshes("fallen", ["tetrahedron.obj"], [[0, 50, 500]], [[0, 0, 0, 1]], [0, 0, -1, 0], 0)
    test.near("a mesh let fall along z", distance(client, [0, 50, 500], [0, 0, -1]), 500 - 1 - math.sqrt(100**2 - 50**2), 1e-3)
    client.loadAndProjectMultipleMeshes("lost", ["tetrahedron.obj"], [[0, 5000, 0]], [[0, 0, 0, 1]], [1, 0, 0, 0], 0)
    client.version()
    test.check("a mesh that meets nothing is told", any("meet no surface" in line for line in client.log), client.log)


def lit_ball(client, textures):
    client.createShape("ball", "sphere.shp", {"radius": 1})
    client.createBody("ball", "ball", "mate", textures)
    client.setObjectPosition("ball", [0, 0, -10])
    client.render()
    return client.getImage()[32, 32]


def lz4_of(data):
    """An LZ4 block of literals alone."""
    left = len(data) - 15
    return bytes([0xF0]) + b"\xff" * (left // 255) + bytes([left % 255]) + data


def check_textures(client):
    start(client)
    client.createUserDataTexture("paint", 8, 4, True)
    client.createUserDataTexture("colours", 8, 4, False)
    white = lit_ball(client, ["paint"])
    test.near("a texture without texels is white", float(white[0]), (AU / (AU + 9))**2, 0.01)
    client.updateUserDataTexture("paint", numpy.full((4, 8), 0.25, "<f4"))
    client.render()
    test.check("float texels", numpy.allclose(client.getImage()[32, 32], 0.25 * white, rtol=1e-4))
    for level in (-1, 0, 9):
        client.updateUserDataTexture("paint", numpy.full((4, 8), 51, "u1"), level)
        client.render()
        test.check(f"texels of 8 bits, level {level}", numpy.allclose(client.getImage()[32, 32], 0.2 * white, rtol=1e-4))
    colours = numpy.broadcast_to(numpy.array([0.1, 0.2, 0.3, 0.4], "<f4"), (4, 8, 4))
    client.attachDynamicTexture("ball", "ball", "colours", 0)
    client.updateUserDataTexture("colours", colours)
    client.render()
    test.check("texels of four channels", numpy.allclose(client.getImage()[32, 32], numpy.array([0.1, 0.2, 0.3, 0.4]) * white, rtol=1e-4),
               client.getImage()[32, 32])
    data = (2 * colours).astype("<f4").tobytes()
    client.send("updateUserDataTexture", {"name": "colours", "data": lz4_of(data), "use_lz4": True, "size": len(data)})
    client.wait("updateUserDataTexture")
    client.render()
    test.check("texels as an LZ4 block", numpy.allclose(client.getImage()[32, 32], numpy.array([0.2, 0.4, 0.6, 0.8]) * white, rtol=1e-4))
    for what, data in (("too few texels", pack(b"\0" * 31, 6)), ("no zlib stream", b"\0\0\0\4abcd"),
                       ("more than there is room for", pack(bytes(10**7), 9))):
        test.refused(what, "updateUserDataTexture: data", lambda: client.command("updateUserDataTexture", "paint", data))


def read_tiff(file):
    """Values and layout of a TIFF of one strip size, little-endian, deflated."""
    data = file.read_bytes()
    at, tags = struct.unpack("<I", data[4:8])[0], {}
    for i in range(struct.unpack_from("<H", data, at)[0]):
        tag, kind, count, value = struct.unpack_from("<HHII", data, at + 2 + 12 * i)
        size = {3: 2, 4: 4}.get(kind, 1)
        place = at + 2 + 12 * i + 8 if count * size <= 4 else value
        tags[tag] = struct.unpack_from(f"<{count}{ {3: 'H', 4: 'I'}.get(kind, 'B')}", data, place)
    strips = b"".join(zlib.decompress(data[start:start + size]) for start, size in zip(tags[273], tags[279]))
    bits, floats = tags[258][0], tags.get(339, (1,))[0] == 3
    values = numpy.frombuffer(strips, "<f4" if floats else f"<u{bits // 8}")
    return values.reshape(tags[257][0], tags[256][0], -1)


def check_saved(client, output):
    start(client)
    lit_ball(client, [])
    picture, gray, depth = client.getImage(), client.getImageGray32F(), client.getDepthMap()
    client.asynchronous = False
    for name in ("a.tif", "b.exr", "c.fits", "d.png"):
        client.saveImage(name)
    test.check("four channels of floats", numpy.array_equal(read_tiff(output / "a.tif"), picture))
    test.check("files of each format", all((output / name).stat().st_size > 100 for name in ("b.exr", "c.fits", "d.png")))
    client.saveImageGray32F("gray.tif")
    test.check("gray floats", numpy.allclose(read_tiff(output / "gray.tif")[..., 0], gray, rtol=1e-6))
    client.saveDepthMap("depth.tif")
    test.check("depths", numpy.array_equal(read_tiff(output / "depth.tif")[..., 0], depth.astype("<f4")))
    client.saveImageGray8("gray8.tif")
    test.check("gray in 8 bits", numpy.array_equal(read_tiff(output / "gray8.tif")[..., 0], client.getImageGray8()))
    client.saveImageSpectrumProjectionQuantized("q.tif", [0.25, 0.25, 0.25, 0.25], 12)
    wanted = numpy.rint(client.getImageSpectrumProjection([0.25] * 4).clip(0, 1) * 4095)
    test.check("quantised to 12 bits", numpy.abs(read_tiff(output / "q.tif")[..., 0] - wanted).max() <= 1)
    test.refused("an ending of no format", ".tif", lambda: client.saveImage("x.jpeg"))
    client.asynchronous = True


with tempfile.TemporaryDirectory(prefix="obscura-published-") as temporary:
    folder = pathlib.Path(temporary)
    (folder / "stars.txt").write_text("1\n0 0 -1 1e-9 1e-9 1e-9 1e-9\n")
    (folder / "resources.toml").write_text('"tycho-2_V_*.bin" = "stars.txt"\n"itokawa_f*.obj" = "rock.obj"\n')
    (folder / "rock.obj").write_text(TETRAHEDRON)
    with Server(obscura, folder, "--resources", str(folder / "resources.toml")) as server, server.connect() as client:
        check_models(client, server.root)
        check_meshes(client, server.root)
        check_textures(client)
        check_saved(client, server.output)
        client.log.clear()
        start(client)
        client.createMesh("rock", "models/itokawa_f3145728.obj", 2.0)
        test.near("a file of the table for a name", distance(client, [0, 0, 10], [0, 0, -1]), 8, 1e-5)
        client.createMesh("other", "itokawa.obj", 1e3)
        client.setObjectPosition("other", [0, 0, -5000])
        test.check("a body stands in for a mesh that is not public", 50 < 5000 - distance(client, [500, 0, -5000], [-1, 0, 0]) and
                   any("not public" in line for line in client.log), client.log)
test.end()
