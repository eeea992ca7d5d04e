#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What calls of the rendering server cost its Python client, beside bare sockets on the same machine in the same run.

Prints for TCP and the Unix socket: an empty call, a change of the scene, a picture of 1024 x 1024 pixels of nothing (4 MiB), as
many pixels of a sensor in the dark by each codec, and a small picture after a change of the scene `demo`, whose body is a mesh. No verdict.

Usage: serve_bench.py OBSCURA [REPEATS]    (as /usr/bin/python3, which has Debian's numpy)
"""
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time

import numpy

from bare_sockets import PICTURE, EchoServer, receive

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients" / "python"))
import obscura_client  # noqa: E402
from obscura_client import protocol  # noqa: E402

obscura, repeats = os.path.abspath(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 2000


def times_us(count, work):
    spent = numpy.empty(count)
    for i in range(count):
        begin = time.perf_counter()
        work(i)
        spent[i] = 1e6 * (time.perf_counter() - begin)
    return f"p50 {numpy.median(spent):9.0f} us, p99 {numpy.percentile(spent, 99):9.0f} us"


def floor(family):
    """Round trips of 64 bytes, and of a picture, between two threads' sockets."""
    small, large = bytearray(64), bytearray(PICTURE)
    with EchoServer(family) as server, server.connect() as client:

        def ask(first, into):
            client.sendall(bytes([first]) + bytes(63))
            receive(client, into)

        print(f"    bare sockets, 64 bytes     {times_us(repeats, lambda _i: ask(0, small))}")
        print(f"    bare sockets, 4 MiB        {times_us(max(repeats // 50, 10), lambda _i: ask(1, large))}")


def dark_frames(camera, family):
    """Pictures of a sensor in the dark, 2 MiB, as they are and by each codec; and, where it can be, 4 MiB of nothing in shared
    memory."""
    count = max(repeats // 50, 10)
    camera.load(scene={"camera": {"width": 1024, "height": 1024}})
    sensor = {"file": "generic", "readout": {"width": 1024, "height": 1024}}
    for codec in protocol.codecs():
        def exposed(_i):
            return camera.render(exposure_s=0.01, sensor=sensor, samples=1, codec=codec)

        exposed(0)
        print(f"    dark frame, {codec:<14} {times_us(count, exposed)}")
    if family == socket.AF_UNIX:
        camera.load(scene={})
        camera.share_memory(pictures=4, mib=8)
        camera.render(size=(1024, 1024), samples=1)
        print(f"    empty picture, shared      {times_us(count, lambda _i: camera.render(size=(1024, 1024), samples=1))}")


with tempfile.TemporaryDirectory(prefix="obscura-bench-") as folder:
    path = os.path.join(folder, "socket")
    server = subprocess.Popen([obscura, "serve", "--listen", "127.0.0.1:0", "--unix", path, "--root", folder],
                              stdout=subprocess.PIPE, text=True)
    addresses = [server.stdout.readline().split()[-1] for _ in range(2)]
    print(f"load {os.getloadavg()[0]:.1f}")
    for family, address in zip((socket.AF_INET, socket.AF_UNIX), addresses):
        print("TCP" if family == socket.AF_INET else "Unix socket")
        floor(family)
        with obscura_client.connect(address) as camera:
            print(f"    status                     {times_us(repeats, lambda _i: camera.status())}")
            print(f"    set of a key of the Sun    {times_us(repeats, lambda i: camera.set('sun', limb_darkening=i / repeats))}")
            camera.load(scene={})
            camera.render(size=(1024, 1024), samples=1)
            print(f"    empty picture, 4 MiB       "
                  f"{times_us(max(repeats // 50, 10), lambda _i: camera.render(size=(1024, 1024), samples=1))}")
            dark_frames(camera, family)
            camera.load("demo")
            camera.render(size=(64, 64), samples=1)

            def moved(i):
                camera.set("body", "asteroid", position_m=[float(i), 0, 0])
                camera.render(size=(64, 64), samples=1)

            print(f"    demo moved, 64 x 64        {times_us(20, moved)}")
    server.terminate()
    server.wait()
