#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""All 154 commands of the published client against `obscura serve`, what errors leave behind, and unread answers.

Usage: published_client_test.py OBSCURA SOURCE-DIRECTORY [--unread N]
Exit status 1 if a check failed, 77 without numpy.
"""
import argparse
import hashlib
import pathlib
import re
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from client_checks import obscura, source  # noqa: E402  skips the test without numpy
import numpy  # noqa: E402
from obscura_client.png import png  # noqa: E402
from published_client import TABLE, qt_stream  # noqa: E402
from published_client.client import pack  # noqa: E402
from published_client.server import Checks, PATIENCE_S, Server  # noqa: E402

AU = 149597870700.0
test = Checks()
parser = argparse.ArgumentParser()
parser.add_argument("obscura")
parser.add_argument("source")
parser.add_argument("--unread", type=int, default=300000, help="answers that are not read")
options = parser.parse_args()


def check_codec():
    """The two counts of scalars that the published client is known to send, and what comes back of a value of each type."""
    place = qt_stream.message("setObjectPosition", {"object_name": "a", "pos": [0.0, 0.0, 0.0]})
    test.check("scalars of setObjectPosition", len(place) == 26, len(place))
    tasks = qt_stream.message("renderMicroTasks", {"utasks": [[0.0] * 9] * 1000})
    test.check("scalars of 1,000 micro tasks", len(tasks) == 30011, len(tasks))
    fields = {"a": None, "b": True, "c": -5, "d": 2**31, "e": 2**40, "f": -2.5, "g": "né\U0001F680", "h": b"\0\1", "i": "", "j": b"",
              "k": [1, "x", [2.0]], "l": {"m": {"n": 1}}}
    data = b"".join(qt_stream.message("x", fields))
    pieces = [data[at:at + 7] for at in range(0, len(data), 7)]
    test.check("a message is read as it was written", qt_stream.Reader(lambda _: pieces.pop(0)).read() == {"": "x", **fields})


SQUARE = """v -1 -1 0
v 1 -1 0
v 1 1 0
v -1 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
g plate
f 1/1 2/2 3/3
g other
f 1/1 3/3 4/4
"""
DEM = """TYPE = "SIMPLE_CYLINDRICAL";
LINES = 90;
LINE_SAMPLES = 180;
MINIMUM_LATITUDE = -90;
MAXIMUM_LATITUDE = 90;
WESTERNMOST_LONGITUDE = -180;
EASTERNMOST_LONGITUDE = 180;
A_AXIS_RADIUS = 1000;
B_AXIS_RADIUS = 1000;
C_AXIS_RADIUS = 1000;
HEIGHTMAP = "relief.png";
"""


def write_resources(root):
    (root / "square.obj").write_text(SQUARE)
    rows, columns = numpy.indices((90, 180))
    (root / "relief.png").write_bytes(png((rows + columns).astype("u1")))
    (root / "map.png").write_bytes(png(numpy.full((8, 16), 128, "u1")))
    (root / "film_00.png").write_bytes(png(numpy.full((8, 16), 64, "u1")))
    (root / "shake.csv").write_text("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n0.01,0,0.001,0,1,0,0,0\n")
    (root / "ball.dem").write_text(DEM)
    (root / "plane.dem").write_text(DEM.replace("SIMPLE_CYLINDRICAL", "PLANAR") + "MAP_SCALE = 0.1;\nSCALING_FACTOR = 0.001;\n")
    (root / "sky.txt").write_text("1\n0.01 0 -1 1e-9 1e-9 1e-9 1e-9\n")
    (root / "sub").mkdir()


ANY = object()  # a result that is not None


def approximately(*wanted):
    return lambda got: numpy.allclose(numpy.ravel(got), wanted, rtol=1e-12, atol=1e-12)


def text(part=""):
    return lambda got: isinstance(got, str) and part in got


def picture(*shape):
    return lambda got: got.shape == shape


def tour(root):
    """Steps: command, arguments, and the result: a value, a predicate, ANY; or REFUSED with a piece of the line."""
    kernel = numpy.zeros((3, 3), "<f4")
    kernel[1, 1] = 1
    hasher = hashlib.md5((root / "map.png").read_bytes()).hexdigest()
    return [
        # connection
        ("version", (), text()), ("printAPI", (), text("setObjectPosition")), ("help", ("setObjectPosition",), text("object_name")),
        ("getRessourcePath", (), text()), ("setRessourcePath", ("sub",), None), ("setRessourcePath", ("",), None),
        ("pwd", (), text()), ("ls", (), text("map.png")), ("cd", ("sub",), None), ("pwd", (), text("sub")), ("cd", ("/",), None),
        ("setMetadata", ("mission", "tour"), None), ("getMetadata", (), lambda got: got.get("mission") == "tour"),
        ("clearMetadata", (), None), ("getMetadata", (), lambda got: "mission" not in got),
        ("setCompressionLevel", (0,), None),
        ("sendFile", ("sent.png", True, 0, False, pack((root / "map.png").read_bytes(), 6)), None),
        ("syncDir", ("folder", [["sent.png", hasher], ["other.png", "0" * 32]], 0), ANY),
        ("reset", (), None),
        # camera
        ("setConventions", (0, 0), None), ("getConventions", (), [0, 0]),
        ("setImageSize", (64, 48.0), None), ("getImageSize", (), [64, 48]),
        ("setCameraFOVDeg", (20, 15), None), ("getCameraFOVDeg", (), approximately(20, 15)),
        ("setCameraFOVRad", (0.4, 0.3), None), ("getCameraFOVRad", (), approximately(0.4, 0.3)),
        ("setIntegrationTime", (0.01,), None), ("getIntegrationTime", (), 0.01), ("setIntegrationTime", (0,), None),
        ("setPSF", (3, 3, kernel.tobytes(), -1, -1, 0), None), ("getPSF", (), lambda got: (got == kernel).all()),
        ("setPSFWithTail", (3, 3, kernel.tobytes(), 3, 3, 3, 3, kernel.tobytes(), 30, 30, 0, 0.0), ANY),
        ("loadPSFModel", ("gaussian.psf", {"sigma": 1.0, "epsilon": 1e-3, "sigma_radius": 4.0}), None),
        ("setPSF", (0, 0, b"", -1, -1, 0), None), ("setFocus", (20.0, 0.01), None), ("setFocus", (0.0, 0.0), None),
        ("loadProjectionModel", ("equidistant.txr", {"k1": 0.01}), None), ("loadProjectionModel", ("pinhole", {}), None),
        ("loadMotionModel", ("shake.csv", {}), None),
        ("loadSpectrumModel", ("bands.txr", {"from": [6e-7, 5e-7, 4e-7, 4e-7], "to": [7e-7, 6e-7, 5e-7, 7e-7]}), None),
        ("loadTimeSamplingModel", ("rolling_shutter.lua", {"line_addressing_time": 1e-5}), None),
        # scene
        ("createBRDF", ("mate", "mate.brdf", {"albedo": [1.0, 1.0, 1.0, 1.0]}), None), ("createBRDF", ("mate", "mate.brdf", 0.12), None),
        ("createShape", ("ball", "sphere.shp", {"radius": 1}), None), ("createBody", ("ball", "ball", "mate", ["map.png"]), None),
        ("exists", ("ball",), True), ("exists", ("nobody",), False), ("exists", ("camera",), True), ("exists", ("sun",), True),
        ("setAlias", ("ball", "globe"), None), ("exists", ("globe",), True),
        ("setObjectPosition", ("globe", [0.0, 0.0, -10.0]), None), ("getObjectPosition", ("ball",), [0, 0, -10]),
        ("setObjectAttitude", ("ball", [0, 0, 2, 2]), None),
        ("getObjectAttitude", ("ball",), approximately(0, 0, 0.5**0.5, 0.5**0.5)),
        ("setObjectMotion", ("ball", [[1.0, 2.0, 3.0], [0.0, 0.0, 0.1]]), None),
        ("getObjectMotion", ("ball",), approximately(1, 2, 3, 0, 0, 0.1)),
        ("setObjectMotion", ("ball", [[0, 0, 0], [0, 0, 0]]), None),
        ("createMesh", ("plate", "square.obj", 1.0), None), ("setObjectElementBRDF", ("plate", "plate", "mate"), None),
        ("setObjectPosition", ("plate", [3.0, 0.0, -12.0]), None),
        ("setObjectElementTransform", ("plate", "", [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], False), None),
        ("getObjectPosition", ("plate",), [3, 0, -12]),
        ("printObjectStructure", ("plate",), text("plate")),
        ("setObjectProperty", ("ball", "photon_map", 0.0), None), ("getObjectProperty", ("ball", "photon_map"), 0.0),
        ("setObjectElementProperty", ("plate", "plate", "skip_path_tracing", 1.0), None),
        ("getObjectElementProperty", ("plate", "plate", "skip_path_tracing"), 1.0),
        ("saveObject", ("plate", "plate.obj"), ANY),
        ("createSphericalDEM", ("relief", "ball.dem", "mate", ""), lambda got: got["A_AXIS_RADIUS"] == 1000 and
         (got["MINIMUM_LATITUDE"], got["MAXIMUM_LATITUDE"]) == (-90, 90)),
        ("setObjectPosition", ("relief", [0.0, 5000.0, -20000.0]), None),
        ("createDEM", ("ground", "plane.dem", "mate", ""), lambda got: "EASTERNMOST_LONGITUDE" in got),
        ("setObjectPosition", ("ground", [0.0, -50.0, -200.0]), None),
        ("loadMultipleMeshes", ("plates", ["square.obj", "square.obj"], [[0, 0, -30], [4, 0, -30]], [[0, 0, 0, 1], [0, 0, 0, 2]]), None),
        ("loadAndProjectMultipleMeshes", ("rocks", ["square.obj"], [[0, 1, -20]], [[0, 0, 0, 1]], [0, 0, 0, 1], 0.5), None),
        # light
        ("createLight", ("lamp", [1.0, 1.0, 1.0, 1.0], 30.0, 1.0), None), ("setObjectPosition", ("lamp", [0.0, 1.0, 0.0]), None),
        ("setSunPower", ([1e22] * 4,), None), ("getSunPower", (), approximately(1e22, 1e22, 1e22, 1e22)),
        ("setSunPowerAtDistance", ([1360.0] * 4, AU), None), ("getSunPower", (), approximately(*[1360 * AU**2] * 4)),
        ("setBackground", ("sky.txt",), None), ("setStarThreshold", (0.0,), None),
        # texture
        ("createUserDataTexture", ("paint", 4, 2, True), None),
        ("updateUserDataTexture", ("paint", pack(numpy.full((2, 4), 0.5, "<f4").tobytes(), 9)), None),
        ("attachDynamicTexture", ("ball", "ball", "paint", 0), None), ("updateDynamicTexture", ("paint",), None),
        ("loadTextureObject", ("loaded", "map.png", {}), None), ("createVideoTexture", ("film", "film_%02d.png", True), None),
        ("updateDynamicTexture", ("film",), None),
        # rendering
        ("enableAutoUpdate", (False,), None), ("enableIrradianceMode", (True,), None), ("getIrradianceMode", (), True),
        ("enableIrradianceMode", (False,), None), ("getIrradianceMode", (), False), ("enableLOSmapping", (True,), None),
        ("getLOSmapping", (), True), ("enablePathTracing", (False,), None), ("enablePhotonAccumulation", (False,), None),
        ("enablePreviewMode", (False,), None), ("getPreviewMode", (), False), ("enableRaySharing", (False,), None),
        ("enableRaytracing", (True,), None), ("enableRegularPixelSampling", (True,), None), ("enableRegularPSFSampling", (True,), None),
        ("enableScanningDeviceMode", (False,), ANY), ("getScanningDeviceMode", (), False), ("enableSkipPixelSampling", (False,), None),
        ("enableSpecularOptimization", (False,), None), ("enableTimeMapping", (False,), ANY), ("getTimeMapping", (), False),
        ("setGlobalVariables", ({"gain": 2.0},), None), ("getGlobalVariables", (), lambda got: got.get("gain") == 2),
        ("setMaxSamplesPerPixel", (64,), None), ("getMaxSamplesPerPixel", (), 64), ("setMaxSecondaryRays", (4,), None),
        ("getMaxSecondaryRays", (), 4), ("setMaxShadowRays", (8,), None), ("getMaxShadowRays", (), 8),
        ("setNbSamplesPerPixel", (2,), None), ("getNbSamplesPerPixel", (), 2), ("setObjectSamples", ("ball", 5.0), None),
        ("getObjectSamples", ("ball",), 5), ("render", (), None), ("updateDisplay", (), None),
        ("createPerPixelProcess", ("process", "process.lua", {}), ANY), ("runPerPixelProcess", ("out", "process"), ANY),
        ("dumpPhotonMapToFile", ("ball", "photons.bin"), ANY),
        # output
        ("getImage", (), picture(48, 64, 4)), ("getImageRGBA8", (), picture(48, 64, 4)), ("getImageGray32F", (), picture(48, 64)),
        ("getImageGray8", (), picture(48, 64)), ("getImageSpectrumProjection", ([0.5, 0.5, 0.0, 0.0],), picture(48, 64)),
        ("getDepthMap", (), picture(48, 64)), ("getNormalMap", (), picture(48, 64, 3)), ("getLOSMap", (), picture(48, 64, 3)),
        ("getTimeMap", (), picture(0, 0)),
        ("intersectScene", ([[0.0, 0.0, 0.0, 0.0, 0.0, -1.0], [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]],), lambda got: abs(got[0] - 9) < 1e-6 and
         got[1] == float("inf")),
        ("saveImage", ("a.tif",), None), ("saveImageGray32F", ("b.tif",), None), ("saveImageGray8", ("c.png",), None),
        ("saveImageRGB8", ("d.png",), None), ("saveDepthMap", ("e.tif",), None),
        ("saveImageSpectrumProjection", ("f.tif", [1, 0, 0, 0]), None),
        ("saveImageSpectrumProjectionQuantized", ("g.png", [1, 0, 0, 0], 12), None),
        ("getState", (), text()), ("printState", ("",), ANY), ("generateMicroTasks", (), lambda got: len(got) == 64 * 48 and
         len(got[0]) == 9),
        # preview
        *[("enableGlobalDynamicShadowMap", (True,), None), ("setCubeMapSize", (512.0,), None), ("getCubeMapSize", (), 512),
          ("setCubeMapZNear", (0.1,), None), ("setFSAA", (4,), None), ("setNearPlane", (0.5,), None), ("setPSFSigma", (0.7,), None),
          ("setObjectDynamicCubeMap", ("ball", True), None), ("getObjectDynamicCubeMap", ("ball",), True),
          ("setObjectDynamicShadowMap", ("ball", True), None), ("getObjectDynamicShadowMap", ("ball",), True),
          ("setPhotonMapSamplingStep", (0.25,), None), ("getPhotonMapSamplingStep", (), 0.25),
          ("setSelfVisibilitySamplingStep", (0.5,), None), ("getSelfVisibilitySamplingStep", (), 0.5),
          ("setShadowMapSize", (1024,), None), ("getShadowMapSize", (), 1024)],
        # removed
        ("enableDoublePrecisionMode", (), ANY), ("enableFastPSFMode", (), ANY), ("enableMultilateralFiltering", (), ANY),
        ("getDoublePrecisionMode", (), ANY),
        # those that end the tour
        ("runLUACode", ("return 1",), ANY), ("runLUAScript", ("sensors/GenericSensor.lua",), ANY),
        ("closeViewer", (), None),
    ]


def refused_commands(source):
    """Commands that the manual says are answered with a line of error."""
    page = (source / "docs" / "published-client.md").read_text(encoding="utf-8")
    section = page.split("Commands that are not there", 1)[1].split("## ", 1)[0]
    refused = set(re.findall(r"`(\w+)`", section))
    working, all_commands = (int(number) for number in re.search(r"(\d+) of its (\d+) commands", page).groups())
    test.check("the manual counts the commands", (working, all_commands) == (len(TABLE) - len(refused), len(TABLE)))
    return refused


def check_tour(server):
    """Every command, its answer read: what it gives, or a line of error that the manual announces."""
    announced, refused = refused_commands(source), set()
    steps = tour(server.root)
    with server.connect(separate_sends=True) as client:
        client.asynchronous = False
        for name, arguments, wanted in steps:
            what = f"{name}{arguments!r}"[:70]
            try:
                got = client.command(name, *arguments)
            except RuntimeError as error:
                refused.add(name)
                test.check(f"{what}: refused as the manual says", name in announced and str(error).startswith("[error] ") and
                           "\n" not in str(error), error)
                continue
            if callable(wanted):
                test.check(what, wanted(got), got)
            elif wanted is not ANY:
                test.check(what, got == wanted or list(numpy.ravel(got)) == wanted, got)
            if name == "generateMicroTasks":  # the left half of the picture
                test.check("renderMicroTasks", client.renderMicroTasks([row for row in got if row[1] < 32]) is None)
                half = client.getImageGray32F()
                test.check("a part of a picture", half[:, :32].max() > 0 and half[:, 32:].max() == 0)
            if name == "getState":  # what setState and printState take
                test.check("setState", client.setState(got) is None)
                test.check("printState", bool(client.printState(got)))
        client.sendImageTo("display", "raw", 5153, 8, 1, "")
        try:
            client.version()
        except RuntimeError as error:
            test.check("sendImageTo is refused as the manual says", "sendImageTo" in str(error), error)
        client.version()
        for name, values in (("nowhere", numpy.zeros((2, 4), "<f4")),):
            test.refused("pixels for a texture that is not there", name, lambda: client.updateUserDataTexture(name, values))
    test.check("every command of the table was sent", client.called == set(TABLE), set(TABLE) - client.called)
    test.check("the manual refuses no command that works", announced <= refused | {"sendImageTo"}, announced - refused)
    with server.connect() as client:  # as the client does, most answers unread
        client.raises = False
        for name, arguments, _ in steps:
            if name not in refused:
                client.command(name, *arguments)
        test.check("the tour again, answers unread", bool(client.version()))
        test.check("its log has no line of error", not [line for line in client.log if "[error]" in line], client.log)


def show_ball(client, x):
    client.reset()
    client.setImageSize(32, 32)
    client.setCameraFOVDeg(20, 20)
    client.setNbSamplesPerPixel(4)
    client.createBRDF("mate", "mate.brdf", 1.0)
    client.createShape("ball", "sphere.shp", {"radius": 1})
    client.createBody("ball", "ball", "mate", [])
    client.setObjectPosition("sun", [0, 0, AU])
    client.setSunPower([3e22] * 4)
    client.setObjectPosition("ball", [x, 0, -10])
    client.render()


def check_errors(server):
    """An error leaves no answer behind that a later call could take for its own, and no client waits for ever."""
    with server.connect() as client:
        show_ball(client, 0)
        middle = client.getImageGray32F().tobytes()
        # A getter fails.
        test.refused("a getter of nobody", "nobody", lambda: client.getObjectPosition("nobody"))
        test.check("the same getter afterwards", client.getObjectPosition("ball") == [0, 0, -10])
        # A setter whose answer is not read: the next that is waited for raises, and leaves nothing.
        client.setObjectPosition("nobody", [1, 2, 3])
        test.refused("a setter of nobody, told by getImageGray32F", "nobody", client.getImageGray32F)
        client.setObjectPosition("ball", [0.5, 0, -10])
        client.render()
        moved = client.getImageGray32F()
        test.check("the next picture is the new one", moved.tobytes() != middle and moved[:, :16].sum() < moved[:, 16:].sum())
        # A setter, then others, then a getter that is asked twice.
        client.setObjectAttitude("ball", [0, 0, 0, 0])
        client.setObjectPosition("ball", [0, 0, -10])
        client.render()
        test.refused("a quaternion of zeros, told by getObjectPosition", "setObjectAttitude", lambda: client.getObjectPosition("ball"))
        test.check("asked again", client.getObjectPosition("ball") == [0, 0, -10])
        test.check("the picture", client.getImageGray32F().tobytes() == middle)
        # Several errors.
        for _ in range(3):
            client.setObjectPosition("nobody", [1, 2, 3])
        for _ in range(3):
            test.refused("one of three errors", "nobody", client.version)
        test.check("then the answer", isinstance(client.version(), str))
        # Answers of setters are read.
        client.asynchronous = False
        test.refused("a setter that waits", "nobody", lambda: client.setObjectPosition("nobody", [0, 0, 0]))
        test.check("and again, right", client.setObjectPosition("ball", [0, 0, -10]) is None)
        test.check("no answer was left over", client.skipped == 0 or client.getObjectPosition("ball") == [0, 0, -10])
        client.asynchronous = True
        # Unknown commands, unknown and missing arguments.
        client.send("enableLabelMapping", {"enable": True})
        test.refused("a command of a later version", "enableLabelMapping", client.version)
        client.send("setObjectPosition", {"object_name": "ball"})
        test.refused("an argument that is missing", "pos", client.version)
        client.send("setObjectPosition", {"object_name": "ball", "pos": "left"})
        test.refused("an argument of another type", "pos", client.version)
        client.setObjectPosition("ball", [float("nan"), 0, 0])
        test.refused("a place that is no number", "pos", client.version)
        test.check("after all of them", client.getObjectPosition("ball") == [0, 0, -10] and client.getImageGray32F().tobytes() == middle)
    with server.connect() as client:  # it prints errors, and waits on
        show_ball(client, 0)
        client.raises = False
        begin = time.monotonic()
        client.setObjectPosition("nobody", [1, 2, 3])
        test.check("a client that prints errors gets the picture", client.getImageGray32F().tobytes() == middle)
        client.send("getObjectPosition", {"object_name": "nobody"})
        test.check("and an answer to what failed", client.wait("getObjectPosition") is not None)
        test.check("then all goes on", client.getObjectPosition("ball") == [0, 0, -10])
        test.check("two lines of error, within the patience", sum("[error]" in line for line in client.log) == 2 and
                   time.monotonic() - begin < PATIENCE_S, client.log)


def check_unread(server, count):
    """As a batch does that sets, renders and saves only."""
    with server.connect() as client:
        show_ball(client, 0)
        setters = [b"".join(qt_stream.message(name, fields)) for name, fields in (
            ("setObjectPosition", {"object_name": "ball", "pos": [0.25, 0.0, -10.0]}), ("setSunPower", {"sun_color": [3e22] * 4}),
            ("setObjectAttitude", {"object_name": "ball", "attitude": [0.0, 0.0, 0.0, 1.0]}), ("setNbSamplesPerPixel", {"nb_samples": 2}))]
        for at in range(0, count, 4000):
            client.send_bytes(b"".join(setters) * (min(4000, count - at) // 4))
        begin = time.monotonic()
        test.check(f"version after {count} answers that nobody read", isinstance(client.version(), str))
        print(f"  {time.monotonic() - begin:.3f} s after the last, {client.skipped} answers skipped")
        test.check("what was set last holds", client.getNbSamplesPerPixel() == 2 and client.getObjectPosition("ball") == [0.25, 0, -10])


def check_pictures(server):
    """Compression, state, and another client's scene."""
    with server.connect() as client, server.connect() as other:
        show_ball(client, 0.2)
        client.enableLOSmapping(True)
        client.render()
        getters = [client.getImage, client.getImageRGBA8, client.getImageGray32F, client.getImageGray8, client.getDepthMap,
                   client.getNormalMap, client.getLOSMap, lambda: client.getImageSpectrumProjection([0.1, 0.2, 0.3, 0.4])]
        by_level = []
        for level in (0, 1, 3, 9):
            client.setCompressionLevel(level)
            by_level.append([getter().tobytes() for getter in getters])
        test.check("levels of compression do not change a picture", all(row == by_level[0] for row in by_level))
        state = client.getState()
        client.setObjectPosition("ball", [-1, 0, -10])
        client.setSunPower([1e20] * 4)
        client.setCameraFOVDeg(40, 40)
        client.setImageSize(16, 16)
        client.setState(state)
        client.render()
        test.check("setState brings the picture back", client.getImage().tobytes() == by_level[0][0])
        other.reset()
        test.check("another client's reset leaves the scene", client.exists("ball") and not other.exists("ball"))


def check_files(server):
    """Files stay below the root, saves below the output folder."""
    (server.root.parent / "secret.txt").write_text("1\n0 0 -1 1 1 1 1\n")
    (server.root / "link.txt").symlink_to(server.root.parent / "secret.txt")
    with server.connect() as client:
        client.asynchronous = False
        for name in ("../secret.txt", str(server.root.parent / "secret.txt"), "/etc/passwd", "link.txt", "a\0b", "sub/../../secret.txt"):
            test.refused(f"a star map outside: {name!r}", "setBackground", lambda: client.setBackground(name))
            if name != "link.txt":
                test.refused(f"a file sent outside: {name!r}", "sendFile", lambda: client.sendFile(name, b"x"))
        (server.output / "out").symlink_to(server.root.parent)
        for name in ("../x.png", "/tmp/x.png", "out/x.png", "a\0.png"):
            test.refused(f"a picture saved outside: {name!r}", "saveImageGray8", lambda: client.saveImageGray8(name))
        test.check("nothing was written there", sorted(path.name for path in server.root.parent.iterdir()) ==
                   ["output", "root", "secret.txt"], list(server.root.parent.iterdir()))
        test.refused("a folder above", "cd", lambda: client.cd("../.."))
        local = server.root.parent / "root" / "sub"
        (local / "big.bin").write_bytes(bytes(range(256)) * 12289)
        (local / "empty.txt").write_bytes(b"")
        for level in (0, 6):
            wanted = client.syncDir(local, level)
            test.check("the server asks for what it does not have", wanted == (["big.bin"] if level == 0 else []), wanted)
        sent = [path for path in server.output.rglob("big.bin")]
        test.check("a synchronised file is the same", [path.read_bytes() == (local / "big.bin").read_bytes() for path in sent] == [True], sent)
        test.check("an empty one too", [path.stat().st_size for path in server.output.rglob("empty.txt")] == [0])


with tempfile.TemporaryDirectory(prefix="obscura-published-") as temporary:
    check_codec()
    with Server(obscura, temporary) as server:
        write_resources(server.root)
        check_tour(server)
        check_errors(server)
        check_unread(server, options.unread)
        check_pictures(server)
        check_files(server)
test.end()
