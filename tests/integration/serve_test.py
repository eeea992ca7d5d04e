#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The rendering server through its Python client: light and geometry beside their formulas, the bytes of `obscura render`,
and clients that do as they please.

Usage: serve_test.py OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed, 77 without numpy.
"""
import inspect
import math
import os
import pathlib
import random
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import client_checks  # noqa: E402: needs the folder above, and gives the folder of the client
import numpy  # noqa: E402
import obscura_client  # noqa: E402
from children import Child  # noqa: E402
from client_checks import PATIENCE_S, check, check_near, check_refused, obscura, source, wait_for  # noqa: E402
from obscura_client import messagepack  # noqa: E402
from obscura_client.connection import Connection  # noqa: E402


def read_fits(file):
    """First image of a FITS file: float32, planes first."""
    data, at, header = file.read_bytes(), 0, {}
    while "END" not in header:
        for card in (data[at + i:at + i + 80].decode("ascii") for i in range(0, 2880, 80)):
            header.setdefault(card[:8].strip(), card[10:].split("/")[0].strip())
        at += 2880
    shape = [int(header[f"NAXIS{axis}"]) for axis in range(int(header["NAXIS"]), 0, -1)]
    return numpy.frombuffer(data, ">f4", math.prod(shape), at).astype("<f4").reshape(shape)


# A ball and a lamp at the place of the camera, which looks along z: the light falls along the line of sight.
def lit_ball(**camera):
    return {"quantity": "radiance", "sun": {"irradiance_scale": 0.0},
            "camera": {"psf_sigma_px": 0.0, "boresight": [0, 0, 1], "up": [0, -1, 0], **camera},
            "lamp": [{"name": "lamp", "intensity_w_sr": [100.0], "boresight": [0, 0, 1], "up": [0, -1, 0]}],
            "body": [{"name": "ball", "shape": "ellipsoid", "radii_m": [1, 1, 1], "albedo": 0.8, "position_m": [0, 0, 10]}]}


with tempfile.TemporaryDirectory(prefix="obscura-serve-") as temporary:
    folder = pathlib.Path(temporary)
    root = folder / "root"
    (root / "sub").mkdir(parents=True)
    path = str(folder / "socket")
    server = Child([obscura, "serve", "--listen", "127.0.0.1:0", "--unix", path, "--root", root, "--clients", "4"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    tcp = server.stdout.readline().split()[-1]
    check("the server says where it listens", server.stdout.readline() == f"listening at {path}\n")
    camera = obscura_client.connect(tcp, PATIENCE_S)

    # Light and geometry
    check("a scene of a dict is loaded", camera.load(scene=lit_ball(width=65, height=65, pixel_pitch_um=2.0,
                                                                    focal_length_mm=10)) == ["ball"])
    picture = camera.render(samples=16, layers=["depth_m", "range_m", "normal.x", "normal.y", "normal.z", "body"], truth=True)
    # Lambert: radiance = albedo / pi * intensity / distance^2, at the point that is nearest.
    check_near("radiance at the centre of a ball", float(picture.values[0, 32, 32]), 0.8 / math.pi * 100 / 9**2, 1e-3)
    check("unit of radiance", picture.unit == "W m-2 sr-1" and picture.quantity == "radiance", picture)
    check_near("depth of the nearest point", float(picture.depth_m[32, 32]), 9.0, 1e-5)
    tangent = 16 * 2e-6 / 10e-3  # of the pixel 16 columns to the right
    along = (10 - math.sqrt(100 - (1 + tangent**2) * 99)) / (1 + tangent**2)
    check_near("depth beside it", float(picture.depth_m[32, 48]), along, 1e-5)
    normal = numpy.array([along * tangent, 0, along - 10])
    check("normal beside it", numpy.allclose(picture.normals[32, 48], normal, atol=1e-5), (picture.normals[32, 48], normal))
    check("pose of the ball", picture.truth["bodies"][0]["position_m"] == [0, 0, 10] and
          picture.truth["bodies"][0]["name"] == "ball", picture.truth)
    check("arrays are views of what was received", picture.values.base is not None and not picture.values.flags.owndata)

    # A global of a texture in SuMoL changes from one frame to the next.
    (root / "gain.txr").write_text("global gain 1;\nvec4 lookup2D(texture tex, vec2 uv, scalar lod) { return vec4(gain); }\n")
    camera.set("body", "ball", albedo_texture={"model": "gain.txr"})
    whole = camera.render(samples=16)
    check("a texture of 1 changes nothing", numpy.array_equal(whole.values, picture.values))
    camera.add("global", name="gain", values=[0.5])
    half = camera.render(samples=16)
    camera.set("global", "gain", values=[0.25])
    quarter = camera.render(samples=16)
    check("a global of 0.5 halves the light", numpy.allclose(half.values, whole.values * 0.5, rtol=1e-6, atol=0))
    check("a global that is set again holds from the next frame on", numpy.allclose(quarter.values, whole.values * 0.25, rtol=1e-6, atol=0)
          and numpy.allclose(half.values, whole.values * 0.5, rtol=1e-6, atol=0))
    check_refused("a global of the wrong size", "bad-scene", 'global "gain": 2 numbers', lambda: (
        camera.set("global", "gain", values=[1, 2]), camera.render(samples=16)))
    camera.remove("global", "gain")
    camera.set("body", "ball", albedo_texture=None)

    # 640 x 480 pixels, 40 x 30 degrees, a ball at 15 and 10 degrees: axes of their own focal lengths.
    tan = {angle: math.tan(math.radians(angle)) for angle in (10, 15, 20)}
    camera.load(scene=lit_ball(width=640, height=480, focal_length_mm=10, pixel_pitch_um=2 * 1e4 * tan[20] / 640,
                               pixel_pitch_y_um=2 * 1e4 * tan[15] / 480))
    camera.set("body", "ball", position_m=[1000 * tan[15], 1000 * tan[10], 1000], radii_m=numpy.full(3, 4.0))
    camera.set("lamp", "lamp", intensity_w_sr=[1e6])
    picture = camera.render(truth=True, samples=4)
    rows, columns = numpy.indices(picture.values[0].shape)
    light = picture.values[0].astype(float)
    # The centre of pixel 0 is at 0.
    check_near("column of a ball at 15 degrees", float((light * columns).sum() / light.sum()), 319.5 + 879.19 * tan[15], 0.3)
    check_near("row of a ball at 10 degrees", float((light * rows).sum() / light.sum()), 239.5 + 895.69 * tan[10], 0.3)
    check("the truth has the pixel", numpy.allclose(picture.truth["bodies"][0]["pixel"],
                                                    [319.5 + 879.19 * tan[15], 239.5 + 895.69 * tan[10]], atol=0.01))

    # The bytes of the command line
    camera.load("demo")
    options = dict(time_s=7.5, samples=3, seed=5, size=(160, 128))
    served = camera.render(**options, exposure_s=0.5)
    words = ["--size", "160x128", "--samples", "3", "--seed", "5", "--time", "7.5", "--exposure", "0.5"]

    def rendered(scene, *more):
        subprocess.run([obscura, "render", scene, "-o", folder / "x.fits", *words, *more], check=True, capture_output=True)
        return read_fits(folder / "x.fits")

    check("the shipped scene has light", float(served.values.max()) > 0)
    check("obscura render makes the same bytes", served.values.tobytes() == rendered("demo").tobytes())
    part = camera.render(**options, exposure_s=0.5, window=(40, 30, 60, 50))
    check("a window has the pixels of the whole", part.values.tobytes() == served.values[:, 30:80, 40:100].tobytes())
    camera.set("camera", focal_length_mm=31.25)
    camera.set("body", "asteroid", position_m=[1.5, -2.25, 1e-3], albedo=0.2)
    camera.add("body", name="moonlet", shape="box", size_m=[80, 90, 100], albedo=0.4, position_m=[-1500, -900, 100])
    camera.set("scene", max_bounces=1)
    changed = camera.render(**options, exposure_s=0.5)
    check("changes change the picture", changed.values.tobytes() != served.values.tobytes())
    (folder / "exported.toml").write_text(camera.export())
    check("the exported scene renders the same bytes", changed.values.tobytes() == rendered(folder / "exported.toml").tobytes())
    with obscura_client.connect(path, PATIENCE_S) as other:
        other.load(toml=camera.export())
        check("another client renders the same bytes of it", other.render(**options, exposure_s=0.5).values.tobytes() ==
              changed.values.tobytes())
        check("it is exported as it was", other.export() == camera.export())
        other.set("body", "asteroid", albedo=0.9)
        check("scenes of clients are their own", camera.get("body", "asteroid")["albedo"] == 0.2)
    camera.remove("body", "moonlet")
    check("a body is removed", [body["name"] for body in camera.get("body")] == ["asteroid"])

    # What is wrong is refused with a line, and changes nothing.
    before = camera.export()
    wrong = check_refused("a value out of range", "bad-scene", "body[0].albedo: 2.5 is out of range, allowed 0 to 1",
                          lambda: camera.set("body", "asteroid", albedo=2.5, position_m=[0, 0, 0]))
    check("its field and what is allowed", (wrong.field, wrong.allowed) == ("body[0].albedo", "0 to 1"), vars(wrong))
    check_refused("a misspelt key", "bad-scene", 'did you mean "width"?', lambda: camera.set("camera", widht=3))
    check_refused("a quaternion of zeros", "bad-scene", "unit quaternion", lambda: camera.set(
        "body", "asteroid", orientation=[0, 0, 0, 0]))
    check_refused("a quaternion that is no number", "bad-scene", "not a finite number", lambda: camera.set(
        "body", "asteroid", orientation=[math.nan, 0, 0, 0]))
    check_refused("a missing body", "bad-scene", 'did you mean "asteroid"?', lambda: camera.set("body", "asteroyd", albedo=0))
    check_refused("TOML that is none", "bad-scene", "scene:2:", lambda: camera.load(toml="name = 'x'\nwidth = = 3\n"))
    check_refused("nothing to load", "bad-argument", "one of", lambda: camera.load())
    check_refused("an unknown call", "unknown-call", 'did you mean "render"?', lambda: camera.call("rendr"))
    check_refused("a misspelt field", "bad-argument", 'did you mean "samples"?', lambda: camera.call("render", sample=4))
    check_refused("an unknown layer", "bad-argument", '"depth" is not known, allowed an array of body', lambda: camera.render(
        layers=["depth"]))
    check_refused("too many pixels", "too-large", "60000 x 60000 pixels, allowed 268435456", lambda: camera.render(
        size=(60000, 60000)))
    check_refused("more pixels than there are", "bad-argument", "1000000000 is out of range, allowed 0 to 65536 px", lambda: camera.render(
        size=(10**9, 10**9)))
    check_refused("a window outside", "bad-argument", "not inside", lambda: camera.render(size=(64, 64), window=(60, 0, 8, 8)))
    check_refused("too many samples", "bad-argument", "1 to 65536", lambda: camera.render(samples=10**6))

    # Files stay below the server's folder.
    (folder / "secret.csv").write_text("ra_deg,dec_deg,v_mag\n1,2,3\n")
    (root / "sub" / "stars.csv").write_text("ra_deg,dec_deg,v_mag\n1,2,3\n")
    (root / "link.csv").symlink_to(folder / "secret.csv")
    for name in ("/etc/passwd", str(folder / "secret.csv"), "../secret.csv", "sub/../../secret.csv", "link.csv", "a\0b"):
        check_refused(f"a file outside: {name!r}", "bad-scene", "only files below the server's folder", lambda: camera.load(
            scene={"stars": {"catalogue": name}}))
        for material in ({"model": name}, {"model": "akimov", "normal_albedo_texture": name}):
            check_refused(f"a model or its image outside: {name!r}", "bad-scene", "only files below the server's folder",
                          lambda: camera.load(scene={"body": [{"shape": "ellipsoid", "radii_m": [1, 1, 1], "material": material}]}))
        if "\0" not in name:
            check_refused(f"a scene outside: {name!r}", "bad-scene", "only files below the server's folder",
                          lambda: camera.load(name))
    check_refused("a list of files outside", "bad-scene", "only files below", lambda: camera.set(
        "scene", kernels=["sub/stars.csv", "/etc/passwd"]))
    (root / "notes.txt").write_text("secret words\n")
    check_refused("a file that is no model is not quoted", "bad-scene", "allowed are .brdf", lambda: camera.load(
        scene={"body": [{"shape": "ellipsoid", "radii_m": [1, 1, 1], "material": {"model": "notes.txt"}}]}))
    check("nothing was changed", camera.export() == before)
    (root / "own.brdf").write_text("vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess)\n"
                                   "{ return diffuse * 0.1 * max(0, (i | n)); }\n")
    camera.load(scene={"body": [{"shape": "ellipsoid", "radii_m": [1, 1, 1], "material": {"model": "own.brdf"}}]})
    check("a model inside is used", str(root / "own.brdf") in camera.export())
    camera.load(scene={"stars": {"catalogue": "sub/stars.csv"}})
    check("a file inside is used", str(root / "sub" / "stars.csv") in camera.export())
    (root / "own.toml").write_text('[stars]\ncatalogue = "sub/stars.csv"\n')
    camera.load("own.toml")
    check("a scene file inside is loaded", "stars.csv" in camera.get("stars")["catalogue"])

    # Cancelling, and clients that vanish
    endless = dict(size=(2048, 2048), samples=65536, bounces=4)
    camera.load("demo")
    asked = camera._connection
    number = asked._send("render", {"width": 2048, "height": 2048, "samples": 65536, "time_s": 0.0})
    check("a request in progress is reported", wait_for(lambda: camera.status().get("call") == "render"))
    check("it is cancelled", camera.call("cancel", request=number) == {"cancelled": 1})
    check_refused("its answer", "cancelled", "cancelled", lambda: asked._receive(number, None))
    check("the next call is answered", camera.render(**options, exposure_s=0.5).values.tobytes() == served.values.tobytes())

    told = []

    def interrupt(*progress):
        told.append(progress)
        raise KeyboardInterrupt

    def interrupt_later(*progress):
        if len(told) == 1:  # once
            threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT)).start()
        told.append(progress)

    for what, progress in ("of the progress function", interrupt), ("while it waits", interrupt_later):
        try:
            camera.render(**endless, progress=progress)
            check(f"a render is interrupted {what}", False)
        except KeyboardInterrupt:
            check(f"a render is interrupted {what}", True)
    check("progress is that of its rows", 0 <= told[0][0] < told[0][1] == 2048, told)
    check("the connection lives on", camera.status()["waiting"] == 0)

    others = [obscura_client.connect(tcp, PATIENCE_S) for _ in range(3)]
    for client in others:
        client.load("demo")
        client._connection._send("render", {"width": 2048, "height": 2048, "samples": 65536})
    full = check_refused("a client too many", "busy", "4 clients are connected already", lambda: obscura_client.connect(tcp))
    for client in others:
        client.close()

    def connects():
        try:
            obscura_client.connect(tcp, PATIENCE_S).close()
            return True
        except obscura_client.ObscuraError:
            return False

    check("work of clients that vanish ends", wait_for(connects))

    # Others send noise meanwhile.
    stop = threading.Event()

    def noise():
        dice = random.Random(1)
        host, port = tcp.split(":")
        while not stop.is_set():
            with socket.create_connection((host, int(port)), PATIENCE_S) as bad:
                head = dice.randbytes(dice.randrange(200))
                start = struct.pack("<4sBBHIIQ", b"OBSC", 1, 1, 0, 1, dice.choice([len(head), 5, 2**32 - 1]),
                                    dice.choice([0, 0, 2**64 - 1]))
                try:
                    bad.sendall((start if dice.random() < 0.7 else b"") + head)
                    if dice.random() < 0.3:  # a reset instead of an end
                        bad.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                except OSError:
                    pass

    threads = [threading.Thread(target=noise) for _ in range(2)]
    for thread in threads:
        thread.start()
    same = all(camera.render(**options, exposure_s=0.5).values.tobytes() == served.values.tobytes() for _ in range(5))
    stop.set()
    for thread in threads:
        thread.join()
    check("noise of others does no harm", same)

    # The table of calls
    described = camera.describe()
    calls = {row["name"]: row for row in described["calls"]}
    wanted = {"size" if name in ("width", "height") else name for name in (field["name"] for field in calls["render"]["fields"])}
    offered = set(inspect.signature(obscura_client.Client.render).parameters) - {"self", "progress"}
    check("the client's render() has the fields of the call", offered == wanted, offered ^ wanted)
    check("the typed calls are asked", camera.calls.scene_load(file="demo")["bodies"] == ["asteroid"] and
          camera.calls.render(width=8, height=8, samples=1)[1]["irradiance"].shape == (1, 8, 8))
    check("the sections are those of scene files", {"[camera]", "[[body]]"} <= {s["heading"] for s in described["sections"]})

    # Pictures
    check("a picture tells what it is", re.fullmatch(r"<Picture 160 x 128 px, 1 band, irradiance up to \S+ W m-2, at 7.5 s>",
                                                     repr(served)), repr(served))
    check("a notebook shows it", served._repr_png_().startswith(b"\x89PNG") and
          served.save(folder / "p.png").read_bytes() == served._repr_png_())
    served.save(folder / "p.npz")
    check("its arrays are saved", (numpy.load(folder / "p.npz")["irradiance"] == served.values).all())

    # The client's MessagePack
    values = [None, True, False, 0, 127, 128, -1, -32, -33, 2**63 - 1, -2**63, 0.1, math.inf, "", "ü" * 40, "x" * 70000,
              [], list(range(20)), {"a": {"b": [1, {"c": None}]}}, {str(i): i for i in range(300)}]
    check("values come back", messagepack.unpack(messagepack.pack(values)) == values)
    packed = messagepack.pack({"name": "x" * 40, "list": [1, 2.5, {"a": None}], "n": 1 << 40})
    for cut in range(len(packed)):
        try:
            messagepack.unpack(packed[:cut])
            check(f"a head cut after {cut} bytes is refused", False)
        except ValueError:
            pass
    for bad in (packed + b"\xc0", b"\xdd\xff\xff\xff\xff", b"\xdb\xff\xff\xff\xff", b"\x91" * 100000, b"\xc1", b"\x81\x01\x02"):
        try:
            messagepack.unpack(bad)
            check(f"{bad[:8]!r} is refused", False)
        except ValueError:
            pass

    # Ends
    camera.close()
    try:
        camera.status()
        check("a closed client says so", False)
    except obscura_client.ConnectionLost:
        check("a closed client says so", True)
    camera = obscura_client.connect(path, PATIENCE_S)
    server.send_signal(signal.SIGTERM)
    check("the server ends on SIGTERM", server.wait(PATIENCE_S) == 0, server.stderr.read())
    check("its socket is gone", not os.path.exists(path))
    try:
        camera.status()
        check("a client of a server that has gone says so", False)
    except obscura_client.ConnectionLost as error:
        check("a client of a server that has gone says so", "\n" not in str(error))
    for address in (path, tcp, "nonsense"):
        try:
            obscura_client.connect(address)
            check(f"no server at {address}", False)
        except obscura_client.ConnectionLost as error:
            check(f"no server at {address}", "is `obscura serve` running there?" in str(error), error)

    refused = subprocess.run([obscura, "serve", "--listen", "0.0.0.0:5152"], capture_output=True, text=True)
    check("other addresses are refused", refused.returncode == 64 and refused.stderr.count("\n") == 1 and
          "only addresses of the loopback interface" in refused.stderr, refused)

    os.chdir(folder)
    with obscura_client.start("demo", threads=1) as own:
        check("a server of the program's own renders the same bytes on one thread",
              own.render(**options, exposure_s=0.5).values.tobytes() == served.values.tobytes())
    # The example program
    runs = [subprocess.run([sys.executable, source / "clients" / "python" / "examples" / "rendezvous.py", "3", folder], text=True,
                           capture_output=True, env={**os.environ, "PYTHONPATH": str(source / "clients" / "python")})
            for _ in range(2)]
    depths = [float(depth) for depth in re.findall(r"nearest surface +([\d.]+) m", runs[0].stdout)]
    check("the rendezvous comes nearer", len(depths) == 3 and depths[0] > depths[1] > depths[2] > 15, runs[0])
    check("it makes the same bytes again", runs[0].stdout == runs[1].stdout and "sha256" in runs[0].stdout, runs[1])
    check("its last scene is a scene file", subprocess.run([obscura, "check", folder / "rendezvous.toml"],
                                                           capture_output=True).returncode == 0)

    # The first example of the documentation, without the last word.
    page = (source / "docs" / "clients.md").read_text()
    first = [line[4:] for line in page.splitlines() if line.startswith("    ")][:3]
    check("the page begins with three lines", first[2].endswith(".show()"), first)
    done = subprocess.run([sys.executable, "-c", "\n".join(first).replace(".show()", ".save('first.png')")], text=True,
                          capture_output=True, env={**os.environ, "PYTHONPATH": str(source / "clients" / "python"),
                                                    "TMPDIR": str(root / "sub")})
    check("they make a picture", done.returncode == 0 and (folder / "first.png").stat().st_size > 1000, done.stderr)
    check("and leave nothing behind", os.listdir(root / "sub") == ["stars.csv"], os.listdir(root / "sub"))

sys.exit(client_checks.end())
