#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How pictures come from the rendering server: digital numbers of a sensor beside those of `obscura capture`, codecs, shared
memory, tokens, and the client for asyncio.

Usage: serve_arrays_test.py OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed, 77 without numpy.
"""
import asyncio
import os
import pathlib
import socket
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import client_checks  # noqa: E402: needs the folder above, and gives the folder of the client
import numpy  # noqa: E402
import obscura_client  # noqa: E402
import obscura_client.aio  # noqa: E402
from children import Child  # noqa: E402
from client_checks import PATIENCE_S, check, check_near, check_refused, obscura, source, wait_for  # noqa: E402
from obscura_client import protocol  # noqa: E402

SCENE = """
[sun]
direction = [-1, -1, -2]
irradiance_scale = 1e-3
[camera]
focal_length_mm = 25
boresight = [0, 0, 1]
up = [0, -1, 0]
[[body]]
name = "box"
shape = "box"
size_m = [0.1, 0.08, 0.12]
albedo = 0.3
colour_curve = [[400, 0.2], [700, 0.5], [1000, 1.0]]
position_m = [0.08, -0.05, 20]
spin_axis = [0.3, 1, 0.1]
spin_rate_deg_per_s = 200
[[lamp]]
name = "flash"
intensity_w_sr = [30]
spectrum = [[400, 0], [900, 1]]
position_m = [0, 0, 1]
"""
CONFIGURATION = """
[scene]
file = "scene.toml"
[sensor]
file = "{sensor}"
[sensor.readout]
width = 96
height = 64
[camera]
exposure_us = 20000
gain_db = 6
{camera}
[trigger]
rate_hz = 10
[render]
samples_per_pixel = 2
[daemon]
seed = 5
run = 7
[gige]
enabled = false
"""


def captured(folder, sensor, camera=""):
    """Digital numbers of the first three frames that `obscura capture` makes."""
    (folder / "camera.toml").write_text(CONFIGURATION.format(sensor=sensor, camera=camera))
    subprocess.run([obscura, "capture", folder / "camera.toml", "-n", "3", "-o", folder / "frames", "--format", "raw"],
                   check=True, capture_output=True)
    return [numpy.fromfile(folder / "frames" / f"frame_{k:06}.raw", "<u2") for k in (1, 2, 3)]


def detector_pictures(camera, folder):
    def sensor(name):
        return {"file": name, "readout": {"width": 96, "height": 64}}

    def exposed(k, **options):
        return camera.render(time_s=(k - 1) * 0.1, frame=k, **{"exposure_s": 0.02, "gain_db": 6, "run": 7, "seed": 5, "samples": 2,
                                                             "sensor": sensor("generic"), **options})

    camera.load("scene.toml")
    pictures = [exposed(k, layers=["depth_m"], truth=True) for k in (1, 2, 3)]
    check("digital numbers are those of obscura capture",
          [p.values.tobytes() for p in pictures] == [f.tobytes() for f in captured(folder, "generic")])
    first = pictures[0]
    check("they are a uint16 array", first.values.dtype == numpy.dtype("<u2") and first.values.shape == (64, 96), first.values.dtype)
    check("of the ADC's bits", first.detector["bits"] == 12 and first.values.max() < 1 << 12 and first.unit == "DN", first)
    check_near("the exposure is what the readout makes of it", first.detector["exposure_s"][0], 0.02, 1e-4)
    check("the depth map has the picture's pixels", first.depth_m.shape == (64, 96) and
          19.9 < numpy.nanmin(first.depth_m) < 20)
    x, y = first.truth["bodies"][0]["pixel"]
    rows, columns = numpy.indices(first.values.shape)
    light = numpy.maximum(first.values.astype(float) - numpy.median(first.values), 0)
    light[light < 100] = 0
    check_near("the body is where the truth says, column", float((light * columns).sum() / light.sum()), x, 3)
    check_near("the body is where the truth says, row", float((light * rows).sum() / light.sum()), y, 3)
    check("another run word has other noise", exposed(1, run=8).values.tobytes() != first.values.tobytes())
    check("the same request has the same", exposed(1).values.tobytes() == first.values.tobytes())
    # has2 keeps charge of the frame before: only a first frame has none.
    check("so it is with another sensor", exposed(1, sensor=sensor("has2")).values.tobytes() ==
          captured(folder, "has2")[0].tobytes())
    part = "width = 24\nheight = 20\noffset_x = 40\noffset_y = 20"
    check("and with a window of it", [exposed(k, window=(40, 20, 24, 20)).values.tobytes() for k in (1, 2, 3)] ==
          [f.tobytes() for f in captured(folder, "generic", part)])
    check("a picture tells what it is", repr(first).startswith("<Picture 96 x 64 px, 1 band, dn up to "), first)
    check("and can be looked at", first._repr_png_().startswith(b"\x89PNG"))
    lit = camera.render(samples=2, seed=5)
    check("light comes from the same renderer afterwards", lit.values.dtype == numpy.dtype("<f4") and lit.values.max() > 0)

    check_refused("a sensor that there is not", "bad-scene", 'did you mean "generic"?', lambda: exposed(1, sensor="generik"))
    check_refused("a key that sensors do not have", "bad-scene", "adc_bit", lambda: exposed(1, sensor={"detector": {"adc_bit": 3}}))
    check_refused("a number as a sensor", "bad-argument", "allowed a name, or a map", lambda: exposed(1, sensor=5))
    check_refused("no exposure", "bad-argument", "0 with a sensor", lambda: exposed(1, exposure_s=0.0))
    check_refused("a size beside a sensor", "bad-argument", "is that of the sensor", lambda: exposed(1, size=(64, 64)))
    check_refused("a window beyond it", "bad-argument", "not inside", lambda: exposed(1, window=(90, 0, 8, 8)))
    check_refused("too large a sensor", "too-large", "allowed 268435456",
                  lambda: exposed(1, sensor={"readout": {"width": 60000, "height": 60000}}))
    (folder.parent / "outside.toml").write_text('name = "x"\n')
    (folder.parent / "map.fits").write_bytes(b"SIMPLE")
    (folder.parent / "outside.sns").write_text("scalar light(scalar mean, scalar x, scalar y) { return 2 * mean; }\n")
    (folder / "inside.sns").write_text((folder.parent / "outside.sns").read_text())
    (folder / "modelled.toml").write_text('name = "x"\nmodel = { model = "../outside.sns" }\n')
    (folder / "maps.toml").write_text('name = "x"\n[detector]\nresponse_map = "../map.fits"\n')
    for field in ("../outside.toml", "/etc/passwd", {"file": "../outside.toml"}, {"file": "/etc/passwd"}, "maps.toml",
                  {"detector": {"dark_map": str(folder.parent / "map.fits")}}, {"model": {"model": "../outside.sns"}}, "modelled.toml"):
        check_refused(f"a file outside: {field}", "bad-scene", "only files below the server's folder", lambda: exposed(1, sensor=field))
    (folder / "own.toml").write_text((source / "config" / "sensors" / "generic.toml").read_text())
    check("a sensor file inside is used", exposed(1, sensor="own.toml").values.size > 0)
    brighter = exposed(1, sensor={"model": {"model": "inside.sns"}}).values.mean(dtype=float)
    check("a model of a sensor is used", brighter > exposed(1, sensor={}).values.mean(dtype=float), brighter)


def codecs(camera):
    camera.load("demo")
    options = dict(samples=2, size=(200, 150), layers=["depth_m", "body"])
    plain = camera.render(**options, codec="none")
    for codec in protocol.codecs()[1:]:
        packed = camera.render(**options, codec=codec)
        check(f"{codec}: the same bytes", packed.values.tobytes() == plain.values.tobytes() and
              all(packed.layers[name].tobytes() == plain.layers[name].tobytes() for name in plain.layers))
        dn = [camera.render(exposure_s=1e-5, sensor="generic", codec=name, samples=1) for name in ("none", codec)]
        check(f"{codec}: the same digital numbers", dn[0].values.tobytes() == dn[1].values.tobytes())
        head, _ = camera._connection.request("render", {"width": 64, "height": 64, "codec": codec})
        check(f"{codec}: the codec of a request is that of its answer alone", "arrays" not in head)
    check("the server tells its codecs", camera.server["codecs"] == ["none", "shuffle-lz4", "shuffle-zstd"], camera.server)
    check_refused("an unknown codec", "bad-argument", "shuffle-zstd", lambda: camera.call("render", codec="lz4"))
    for codec in ("gzip", *(set(("shuffle-lz4", "shuffle-zstd")) - set(protocol.codecs()))):
        try:
            camera.render(codec=codec)
            check(f"{codec} is refused here", False)
        except obscura_client.ObscuraError as error:
            check(f"{codec} is refused here", "allowed none" in str(error) or "Debian package" in str(error), error)


def shared_memory(camera):
    camera.load("demo")
    options = dict(samples=1, size=(128, 128), layers=["depth_m"])
    received = camera.render(**options)
    camera.share_memory(pictures=2, mib=1)
    first = camera.render(**options)
    check("a picture in shared memory is the same", first.values.tobytes() == received.values.tobytes() and
          first.depth_m.tobytes() == received.depth_m.tobytes() and first.is_whole)
    check("its arrays cannot be written", not first.values.flags.writeable)
    kept = first.copy()
    second = camera.render(**options, time_s=500)
    check("the next one stands beside it", first.is_whole and second.values.tobytes() != kept.values.tobytes())
    third = camera.render(**options, time_s=900)
    check("the one after that overwrites it", not first.is_whole and second.is_whole and third.is_whole)
    check("and is what is there", first.values.tobytes() == third.values.tobytes())
    check("a copy stays", kept.is_whole and kept.values.tobytes() == received.values.tobytes())
    try:
        first.copy()
        check("no copy of what is gone", False)
    except obscura_client.ObscuraError as error:
        check("no copy of what is gone", "a later picture" in str(error))
    check("what does not fit is received", camera.render(size=(600, 600), samples=1).values.shape == (1, 600, 600))
    check_refused("too much of it", "too-large", "allowed 1073741824 in all", lambda: camera.share_memory(64, 64))
    check("refused, pictures stay where they were", camera.render(**options).values.tobytes() == received.values.tobytes())


def tokens(folder, root):
    made = subprocess.run([obscura, "serve", "--make-token", folder / "token"], capture_output=True, text=True)
    check("a token is made", made.returncode == 0 and (folder / "token").stat().st_size == 32, made)
    check("for its owner and group", (folder / "token").stat().st_mode & 0o777 & ~0o640 == 0)
    again = subprocess.run([obscura, "serve", "--make-token", folder / "token"], capture_output=True, text=True)
    check("and never overwritten", again.returncode == 73 and again.stderr.count("\n") == 1, again)
    (folder / "looker").write_bytes(os.urandom(32))
    (folder / "looker").chmod(0o400)
    (folder / "open").write_bytes(bytes(32))
    (folder / "open").chmod(0o644)
    for words, status, why in ((["--listen", "0.0.0.0:0"], 64, "--token-file"),
                               (["--listen", "0.0.0.0:0", "--token-file", folder / "open"], 78, "mode 0644"),
                               (["--listen", "0.0.0.0:0", "--token-file", folder / "none"], 78, "No such file")):
        refused = subprocess.run([obscura, "serve", *words], capture_output=True, text=True)
        check(f"not without a good token: {why}", refused.returncode == status and refused.stderr.count("\n") == 1 and
              why in refused.stderr, refused)
    server = Child([obscura, "serve", "--listen", "0.0.0.0:0", "--token-file", folder / "token", "--token-file",
                               f"view:{folder / 'looker'}", "--root", root], stdout=subprocess.PIPE, text=True)
    port = server.stdout.readline().rsplit(":", 1)[1].strip()
    # Not the loopback address where there is another one.
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as route:
        try:
            route.connect(("192.0.2.1", 9))
            host = route.getsockname()[0]
        except OSError:
            host = "127.0.0.1"
    address = f"{host}:{port}"
    check_refused("a client without", "forbidden", "wants a token", lambda: obscura_client.connect(address, PATIENCE_S))
    check_refused("a wrong token", "forbidden", "is not one of this server's",
                  lambda: obscura_client.connect(address, PATIENCE_S, token=bytes(32)))
    with obscura_client.connect(address, PATIENCE_S, token=folder / "token") as camera:
        check("the right one", camera.server["permission"] == "scene", camera.server)
        camera.load("demo")
        codec = protocol.codec_for(None, camera._connection.is_local, camera.server)
        check("another machine's pictures are compressed", codec == (protocol.codecs() + ["none"])[1] or host == "127.0.0.1", codec)
        check("and are what they are", camera.render(size=(64, 64), samples=1).values.max() > 0)
    with obscura_client.connect(address, PATIENCE_S, token=(folder / "looker").read_bytes()) as camera:
        check("one that permits less", camera.server["permission"] == "view", camera.server)
        check_refused("permits less", "forbidden", 'needs the permission "scene"', lambda: camera.load("demo"))
    for bad in (b"short", folder / "none"):
        try:
            obscura_client.connect(address, PATIENCE_S, token=bad)
            check("a token that is none", False)
        except obscura_client.ObscuraError as error:
            check("a token that is none", "token" in str(error) or "No such file" in str(error), error)

    async def later():
        async with await obscura_client.aio.connect(address, PATIENCE_S, token=folder / "token") as camera:
            return (await camera.status())["waiting"]

    check("also for asyncio", asyncio.run(later()) == 0)
    server.terminate()
    check("the server ends", server.wait(PATIENCE_S) == 0)


async def with_asyncio(path, wanted):
    async with await obscura_client.aio.connect(path, PATIENCE_S) as camera:
        check("asyncio: bodies of a scene", await camera.load("demo") == ["asteroid"])
        options = dict(samples=1, size=(64, 64))
        pictures = await asyncio.gather(*(camera.render(float(k), **options) for k in range(8)))
        check("asyncio: pictures asked for at once are those of the other client",
              [p.values.tobytes() for p in pictures] == [w.values.tobytes() for w in wanted])
        check("asyncio: typed calls are asked", (await camera.calls.scene_get(section="body", item="asteroid"))["keys"]["name"] ==
              "asteroid" and (await camera.calls.render(width=8, height=8))[1]["irradiance"].shape == (1, 8, 8))
        told = []
        endless = asyncio.create_task(camera.render(size=(2048, 2048), samples=65536, bounces=4, progress=lambda *p: told.append(p)))
        behind = asyncio.create_task(camera.render(1.0, **options))
        while (await camera.status()).get("call") != "render":
            await asyncio.sleep(0.01)
        endless.cancel()
        try:
            await endless
            check("asyncio: a task is cancelled", False)
        except asyncio.CancelledError:
            check("asyncio: a task is cancelled", True)
        check("asyncio: and its request with it, so that the next is answered",
              (await behind).values.tobytes() == wanted[1].values.tobytes())
        await camera.set("body", "asteroid", albedo=0.5)
        check("asyncio: scenes are changed", (await camera.get("body", "asteroid"))["albedo"] == 0.5 and
              "albedo = 0.5" in await camera.export())
        try:
            await camera.call("rendr")
            check("asyncio: mistakes are raised", False)
        except obscura_client.RequestError as error:
            check("asyncio: mistakes are raised", error.code == "unknown-call", error)

        def fails(*_progress):
            raise ZeroDivisionError

        try:
            await camera.render(size=(2048, 2048), samples=65536, bounces=4, progress=fails)
            check("asyncio: what a progress function raises is raised", False)
        except ZeroDivisionError:
            check("asyncio: what a progress function raises is raised", True)
        check("asyncio: the connection lives on", (await camera.render(1.0, **options)).values.max() > 0)
    try:
        await camera.status()
        check("asyncio: a closed client says so", False)
    except obscura_client.ConnectionLost:
        check("asyncio: a closed client says so", True)


with tempfile.TemporaryDirectory(prefix="obscura-serve-") as temporary:
    top = pathlib.Path(temporary)
    root = top / "root"
    root.mkdir()
    (root / "scene.toml").write_text(SCENE)
    os.chdir(top)
    with obscura_client.start(root=root, timeout_s=PATIENCE_S) as own:
        detector_pictures(own, root)
        codecs(own)
    with obscura_client.start(root=root, timeout_s=PATIENCE_S) as own:
        shared_memory(own)
    tokens(top, root)
    path = str(top / "socket")
    server = Child([obscura, "serve", "--listen", "none", "--unix", path], stdout=subprocess.PIPE, text=True)
    server.stdout.readline()
    with obscura_client.connect(path, PATIENCE_S) as other:
        other.load("demo")
        expected = [other.render(float(k), samples=1, size=(64, 64)) for k in range(8)]
    asyncio.run(with_asyncio(path, expected))

    async def gone():
        camera = await obscura_client.aio.connect(path, PATIENCE_S)
        await camera.load("demo")
        waiting = asyncio.create_task(camera.render(size=(2048, 2048), samples=65536, bounces=4))
        while (await camera.status()).get("call") != "render":
            await asyncio.sleep(0.01)
        server.terminate()
        try:
            await waiting
        except obscura_client.ConnectionLost:
            return True
        return False

    check("asyncio: a server that goes ends the wait", asyncio.run(gone()))
    check("and it is gone", wait_for(lambda: server.poll() is not None))

sys.exit(client_checks.end())
