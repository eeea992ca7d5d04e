#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a client of the rendering server sees while others misbehave: the time of its calls, for each kind of misbehaviour.

The client calls `status` and sets a key, in turn, over the Unix socket; the others come over TCP. Then the same at the door of the
published client, where it moves an object and asks where it is. Exit status 1 if a call of the client failed or the server ended; no
verdict on the times.

Usage: serve_abuse.py OBSCURA [SECONDS]    of each kind (as /usr/bin/python3, which has Debian's numpy)
"""
import contextlib
import multiprocessing
import os
import pathlib
import random
import socket
import struct
import subprocess
import sys
import tempfile
import time

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients" / "python"))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import obscura_client  # noqa: E402
from obscura_client import messagepack, protocol  # noqa: E402
from published_client import PublishedClient, door_abuse, qt_stream  # noqa: E402

obscura, seconds = os.path.abspath(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else 3
FRAME = struct.Struct("<4sBBHIIQ")


class Abuser:
    """Opens connections to the server and sends what it is told."""

    def __init__(self, address):
        host, port = address.split(":")
        self.address, self.dice = (host, int(port)), random.Random(1)

    def open(self, greet=True):
        sock = socket.create_connection(self.address, 10)
        if greet:
            sock.sendall(protocol.request(1, "hello", {}))
        return sock

    def send(self, data, greet=True, read=True):
        with contextlib.suppress(OSError), self.open(greet) as sock:
            sock.sendall(data)
            sock.settimeout(0.2)
            while read and sock.recv(1 << 16):
                pass

    def head(self, head, bytes_said=None, body=0):
        return FRAME.pack(b"OBSC", 1, 1, 0, 9, len(head) if bytes_said is None else bytes_said, body) + head

    # Each is called until its time is over.

    def lengths(self):
        """Counts and lengths of 2^32 - 1."""
        for head in (b"\xdf\xff\xff\xff\xff", b"\x81\xa1a\xdb\xff\xff\xff\xff", b"\x81\xa1a\xdd\xff\xff\xff\xff"):
            self.send(self.head(head), read=False)
        self.send(self.head(b"", 0xFFFFFFFF), read=False)
        self.send(self.head(b"", 0, 2**64 - 1), read=False)

    def nesting(self):
        """100,000 levels."""
        self.send(self.head(b"\x81\xa1a" + b"\x91" * 100_000), read=False)
        self.send(self.head(b"\x81\xa1a" * 100_000), read=False)

    def values(self):
        """A head of a million values, and one of 1 MiB of text in a scene."""
        self.send(self.head(b"\x81\xa1a\xdd" + struct.pack(">I", 1_000_000) + b"\xc0" * 1_000_000), read=False)
        self.send(protocol.request(2, "scene.load", {"toml": "x = [" * 100_000}), read=False)
        self.send(protocol.request(2, "scene.load", {"toml": "a." * 250_000}), read=False)

    def cut(self):
        """A request that ends after any byte."""
        whole = protocol.request(2, "scene.set", {"section": "sun", "keys": {"limb_darkening": 0.5}})
        for at in range(0, len(whole), 7):
            self.send(whole[:at], read=False)

    def resets(self):
        """Connections that are reset in the middle of a picture."""
        with contextlib.suppress(OSError), self.open() as sock:
            sock.sendall(protocol.request(2, "render", {"width": 1024, "height": 1024, "samples": 1}))
            sock.recv(1 << 12)
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))

    def unread(self):
        """2,000 pictures that are not read."""
        with contextlib.suppress(OSError), self.open() as sock:
            sock.settimeout(1)
            for number in range(2, 2002):
                sock.sendall(protocol.request(number, "render", {"width": 512, "height": 512, "samples": 1}))
            time.sleep(0.5)

    def slow(self):
        """200 connections that send a byte now and then."""
        with contextlib.ExitStack() as stack:
            socks = []
            for _ in range(200):
                with contextlib.suppress(OSError):
                    socks.append(stack.enter_context(self.open(greet=False)))
            data = self.head(messagepack.pack({"call": "hello"}))
            for at in range(8):
                for sock in socks:
                    with contextlib.suppress(OSError):
                        sock.send(data[at:at + 1])
                time.sleep(0.1)

    def many(self):
        """2,000 connections, one after the other."""
        for _ in range(2000):
            with contextlib.suppress(OSError):
                self.open(greet=False).close()

    def noise(self):
        """Random bytes."""
        self.send(self.dice.randbytes(self.dice.randrange(1, 5000)), greet=self.dice.random() < 0.5, read=False)
        head = self.dice.randbytes(self.dice.randrange(200))
        self.send(self.head(head), read=False)

    def requests(self):
        """What no scene can be: quaternions of zeros, numbers that are none, 10^9 x 10^9 pixels, files elsewhere."""
        body = {"name": "b", "shape": "ellipsoid", "radii_m": [1, 1, 1]}
        for call, fields in (("scene.add", {"section": "body", "keys": {**body, "orientation": [0, 0, 0, 0]}}),
                             ("scene.add", {"section": "body", "keys": {**body, "position_m": [float("nan"), 0, 0]}}),
                             ("render", {"width": 10**9, "height": 10**9}), ("render", {"samples": 2**62}),
                             ("render", {"width": 16384, "height": 16384, "samples": 1, "sensor": "has2"}),
                             ("scene.load", {"file": "../../../etc/passwd"}), ("scene.load", {"file": "a\0b"}),
                             ("render", {"exposure_s": 1.0, "sensor": {"readout": {"width": 2**31 - 1, "height": 1}}}),
                             ("memory.open", {"slots": 64, "bytes": 10**12}), ("hello", {"proof": "0" * 500_000})):
            self.send(protocol.request(2, call, fields), read=False)

    def wrong_tokens(self):
        """Proofs of tokens, none of which is wanted here."""
        for _ in range(50):
            self.send(protocol.request(2, "challenge", {}) + protocol.request(3, "hello", {"proof": "0" * 64}), read=False)

    def renders(self):
        """A picture of 65,536 samples a pixel, which is cancelled by the end of the connection."""
        with contextlib.suppress(OSError), self.open() as sock:
            sock.sendall(protocol.request(2, "scene.load", {"file": "demo"}))
            sock.sendall(protocol.request(3, "render", {"samples": 65536, "width": 1024, "height": 1024}))
            time.sleep(0.5)


class DoorAbuser:
    """The same at the door of the published client."""

    def __init__(self, port):
        self.port = port

    def broken(self):
        """Streams that cannot be read on: lengths that lie, endless nesting."""
        for data in door_abuse.BROKEN.values():
            door_abuse.reset(self.port, data)

    def values(self):
        """A message of 3,900,000 values, and one of 60 MiB of text."""
        door_abuse.reset(self.port, door_abuse.values(3_900_000))
        with contextlib.suppress(OSError, RuntimeError), PublishedClient("127.0.0.1", self.port) as client:
            client.setMetadata("text", "x" * (30 << 20))
            client.version()

    def cut(self):
        """A message that ends after any byte."""
        door_abuse.cuts(self.port)

    def resets(self):
        """Connections that are reset in the middle of a picture."""
        door_abuse.resets(self.port, 20)

    def unread(self):
        """2,000 pictures of 512 x 512 that are not read."""
        with contextlib.suppress(OSError, RuntimeError), PublishedClient("127.0.0.1", self.port) as client:
            client.render()
            client.send_bytes(b"".join(qt_stream.message("getImage", {})) * 2000)
            client.version()

    def setters(self):
        """100,000 setters whose answers are not read."""
        with contextlib.suppress(OSError, RuntimeError), PublishedClient("127.0.0.1", self.port) as client:
            client.send_bytes(door_abuse.MOVE * 100_000)
            client.version()

    def slow(self):
        """200 connections that send a byte now and then."""
        door_abuse.slow(self.port, 200, 0.1)

    def many(self):
        """2,000 connections at once."""
        door_abuse.many(self.port, 2000)

    def noise(self):
        """Random bytes."""
        door_abuse.noise(self.port, 50)

    def renders(self):
        """A picture of 65,536 samples a pixel, which is cancelled by the end of the connection."""
        with contextlib.suppress(OSError, RuntimeError), PublishedClient("127.0.0.1", self.port) as client:
            client.createBRDF("mate", "mate.brdf", 1.0)
            client.createShape("ball", "sphere.shp", {"radius": 5.0})
            client.createBody("ball", "ball", "mate", [])
            client.setObjectPosition("ball", [0.0, 0.0, -10.0])
            client.setNbSamplesPerPixel(65536)
            client.render()
            time.sleep(0.5)
            client.send_bytes(b"\xff" * 100)  # an end without `close`


def measured(calls, abuse):
    """Times of the client's two calls, us, while another process calls `abuse` again and again."""
    def repeat():
        while True:
            abuse()

    abusers = multiprocessing.get_context("fork").Process(target=repeat)
    abusers.start()
    spent, end = [], time.perf_counter() + seconds
    while time.perf_counter() < end:
        begin = time.perf_counter()
        calls[len(spent) % 2]()
        spent.append(1e6 * (time.perf_counter() - begin))
        time.sleep(0.002)
    abusers.kill()
    abusers.join()
    return spent


def report(title, server, abuser, calls):
    print(f"{title}; load {os.getloadavg()[0]:.1f}; of {seconds:g} s each, us")
    names = [name for name, member in vars(type(abuser)).items() if not name.startswith("_") and member.__doc__]
    for name in ["nobody"] + names:
        spent = measured(calls, (lambda: time.sleep(0.01)) if name == "nobody" else getattr(abuser, name))
        with open(f"/proc/{server.pid}/status", encoding="ascii") as status:
            resident = next(int(line.split()[1]) // 1024 for line in status if line.startswith("VmRSS"))
        text = "" if name == "nobody" else " ".join(getattr(abuser, name).__doc__.split())
        print(f"{name:14} p50 {numpy.median(spent):7.0f}  p99 {numpy.percentile(spent, 99):7.0f}  most {max(spent):7.0f}  "
              f"{resident:5} MiB  {text}", flush=True)


with tempfile.TemporaryDirectory(prefix="obscura-abuse-") as folder:
    path = os.path.join(folder, "socket")
    server = subprocess.Popen([obscura, "serve", "--listen", "127.0.0.1:0", "--unix", path, "--root", folder, "--compatible",
                               "127.0.0.1:0"], stdout=subprocess.PIPE, text=True)
    tcp = server.stdout.readline().split()[-1]
    server.stdout.readline()  # the Unix socket
    door = int(server.stdout.readline().rsplit(":", 1)[1])
    with obscura_client.connect(path, 60) as camera:
        report("native protocol", server, Abuser(tcp),
               (lambda: camera.set("sun", limb_darkening=0.5), camera.status))
    with PublishedClient("127.0.0.1", door) as client:
        report("door of the published client", server, DoorAbuser(door),
               (client.version, lambda: (client.setObjectPosition("sun", [0.0, 0.0, 1.5e11]), client.getObjectPosition("sun"))))
    ended = server.poll()
    server.terminate()
    server.wait()
sys.exit(0 if ended is None else 1)
