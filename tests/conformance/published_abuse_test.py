#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What breaks servers, sent to the door of the published client while another client works: lengths that lie, endless nesting,
slow writers, cut messages, unread pictures, random bytes, a flood of connections, messages and data that grow, paths that
climb. All answers of the other client come, each the right one, and the server's memory stays within bounds.

How long its answers take is measured by tests/bench/serve_abuse.py.

Usage: published_abuse_test.py OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed, 77 without numpy.
"""
import math
import pathlib
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from client_checks import obscura  # noqa: E402  skips the test without numpy
from published_client import door_abuse, qt_stream  # noqa: E402
from published_client.server import PATIENCE_S, Checks, Server  # noqa: E402

test = Checks()
CLIENTS, MEMORY_MIB = 64, 256
# Beside what is counted: the program itself, scenes, what the renderer and 64 threads take.
MOST_MIB = MEMORY_MIB + 512


class Worker:
    """Another client: it moves a ball, asks where it is, and gets a picture now and then."""

    def __init__(self, server):
        self.client = server.connect()
        self.client.setImageSize(32, 32)
        self.client.createBRDF("mate", "mate.brdf", 1.0)
        self.client.createShape("ball", "sphere.shp", {"radius": 1.0})
        self.client.createBody("ball", "ball", "mate", [])
        self.client.setObjectPosition("ball", [0.0, 0.0, -10.0])
        self.client.render()
        self.picture = self.client.getImage().tobytes()
        self.answers, self.error, self.stop = 0, None, False
        self.thread = threading.Thread(target=self.work)
        self.thread.start()

    def work(self):
        try:
            while not self.stop:
                place = [0.001 * self.answers, 2.0, -10.0]
                self.client.setObjectPosition("ball", place)
                if self.client.getObjectPosition("ball") != place:
                    raise ValueError(f"the answer after {self.answers} is another's")
                if self.answers % 20 == 0 and self.client.getImage().tobytes() != self.picture:
                    raise ValueError("the picture is another one")
                self.answers += 1
                time.sleep(0.001)
        except Exception as error:  # noqa: BLE001  the main thread tells it
            self.error = error

    def goes_on(self):
        end, last = time.monotonic() + PATIENCE_S, self.answers + 10
        while self.answers < last and time.monotonic() < end and self.error is None:
            time.sleep(0.005)
        return self.error is None and self.answers >= last


def memory_mib(server):
    for line in pathlib.Path(f"/proc/{server.process.pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024
    return 0


def message(name, /, **fields):
    return b"".join(qt_stream.message(name, fields))


def broken_streams(server):
    for what, data in door_abuse.BROKEN.items():
        got = door_abuse.tell(server.port, data)
        test.check(f"{what}: a line, and the end of the connection", got.count(b"[error] ") == 1, got)


def too_much(server):
    """Each is within the limits of a message, and beyond what the clients may hold together."""
    with server.connect() as client:
        client.send_bytes(door_abuse.values(3_900_000))
        test.refused("a message of 3,900,000 values", "that clients hold", client.version)
    with server.connect() as client:
        client.setImageSize(8192, 8192)
        client.render()
        test.refused("a picture of 8192 x 8192", "that clients hold", client.version)
        client.setImageSize(16, 16)
        client.render()
        test.check("and then a small one", client.getImage().shape == (16, 16, 4))


def unread_pictures(server):
    with server.connect() as client:
        client.setImageSize(512, 512)
        client.setNbSamplesPerPixel(1)
        client.render()
        client.getImage()
        client.send_bytes(message("getImage") * 2000)
        test.check("2,000 pictures that nobody reads hold nothing up", client.version() is not None)


def flood(server):
    door_abuse.many(server.port, 2000)
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        try:
            with server.connect() as client:
                return test.check("after 2,000 connections there is a place again", client.version() is not None)
        except (RuntimeError, OSError):
            time.sleep(0.02)
    return test.check("after 2,000 connections there is a place again", False)


def inflating(server):
    data = door_abuse.zeros_packed(64)
    with server.connect() as client:
        client.createUserDataTexture("t", 16, 16, True)
        client.send_bytes(message("updateUserDataTexture", name="t", data=data))
        test.refused(f"1 GiB in {len(data) / 2**20:.1f} MiB", "updateUserDataTexture", client.version)


def nonsense(server):
    (server.root / "out").symlink_to("/etc")
    with server.connect() as client:
        client.asynchronous = False
        for what, wanted, call in (
                ("a quaternion of NaN", "allowed", lambda: client.setObjectAttitude("camera", [math.nan] * 4)),
                ("a quaternion of 0", "allowed", lambda: client.setObjectAttitude("camera", [0.0] * 4)),
                ("10^9 x 10^9 pixels", "allowed", lambda: client.setImageSize(10**9, 10**9)),
                ("no samples", "allowed", lambda: client.setNbSamplesPerPixel(0)),
                ("a position of infinity", "pos", lambda: client.setObjectPosition("sun", [math.inf, 0, 0])),
                ("a short PSF", "allowed", lambda: client.setPSF(9, 9, bytes(4), -1, -1, 0)),
                ("a path that climbs", "createMesh", lambda: client.createMesh("m", "../../etc/passwd", 1.0)),
                ("an absolute path", "createMesh", lambda: client.createMesh("m", "/etc/passwd", 1.0)),
                ("a path through a link", "createMesh", lambda: client.createMesh("m", "out/passwd", 1.0)),
                ("a path with a NUL", "createMesh", lambda: client.createMesh("m", "a\0b", 1.0))):
            test.refused(what, wanted, call)
        test.check("the connection lives on", client.version() is not None)


with tempfile.TemporaryDirectory(prefix="obscura-published-") as folder, \
        Server(obscura, folder, "--clients", str(CLIENTS), "--memory", str(MEMORY_MIB)) as server:
    worker = Worker(server)
    try:
        for what, abuse in (
                ("broken streams", broken_streams), ("too much", too_much), ("pictures that nobody reads", unread_pictures),
                ("nonsense", nonsense), ("data that inflate", inflating),
                ("messages cut after every byte", lambda _: door_abuse.cuts(server.port)),
                ("slow writers", lambda _: door_abuse.slow(server.port, CLIENTS - 8, 0.01)),
                ("random bytes", lambda _: door_abuse.noise(server.port, 300)),
                ("connections that are reset", lambda _: door_abuse.resets(server.port, 100)), ("2,000 connections", flood)):
            first = worker.answers
            abuse(server)
            test.check(f"another client's answers come beside {what}", worker.goes_on(), worker.error)
            print(f"  {worker.answers - first} of them")
    finally:
        worker.stop = True
        worker.thread.join()
    most = memory_mib(server)
    test.check(f"the server has taken {most:.0f} MiB at most", 0 < most < MOST_MIB, MOST_MIB)
    test.check("it runs on", server.process.poll() is None)
test.end()
