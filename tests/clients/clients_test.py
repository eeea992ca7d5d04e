#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A client in its own language, beside a server and beside servers that are broken; then its examples.

Usage: clients_test.py OBSCURA OBSCURAD SOURCE-DIRECTORY LANGUAGE [CLASSES]
LANGUAGE: java (with the folder of compiled classes), lua. Exit status 1 if a check failed, 77 if the language is not installed.
"""
import os
import pathlib
import re
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import zlib

try:
    import numpy  # noqa: F401
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)

obscura, obscurad, language = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2]), sys.argv[4]
source, classes = pathlib.Path(sys.argv[3]).resolve(), sys.argv[5] if len(sys.argv) > 5 else None
sys.path[:0] = [str(source / "tests" / "support"), str(source / "clients" / "python"), str(source / "clients" / "stubs")]
from children import Child  # noqa: E402
from described import running_daemon  # noqa: E402

PATIENCE_S = 300
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good else f': {detail}'}", flush=True)
    if not good:
        failures.append(what)


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def answer(head, body=b"", head_bytes=None):
    return struct.pack("<4sBBHIIQ", b"OBSC", 1, 2, 0, 1, len(head) if head_bytes is None else head_bytes, len(body)) + head + body


def row(offset, count, shape):
    """A head with one row of `arrays`: float32 numbers, 8 bits a number, string and code as short as they get."""
    def text(word):
        return bytes([0xA0 + len(word)]) + word
    return (b"\x81" + text(b"arrays") + b"\x91\x86" + text(b"name") + text(b"x") + text(b"dtype") + text(b"<f4") + text(b"codec") +
            text(b"none") + text(b"offset") + bytes([offset]) + text(b"bytes") + bytes([count]) + text(b"shape") + b"\x91" +
            bytes([shape]))


# What a broken server answers to the first request, and what the client says of it.
BROKEN = [
    (None, "no answer in time"),
    (b"", "ended the connection"),
    (b"HTTP/1.1 400 Bad Request\r\n\r\n", "does not speak this protocol"),
    (answer(b"", head_bytes=2**32 - 1), "too large"),
    (answer(b"\x81\xa1"), "not MessagePack"),
    (answer(b"\x91" * 100000), "not MessagePack"),
    (answer(b"\x90"), "no map"),
    (answer(row(4, 8, 2), b"12345678"), "outside the message"),
    (answer(row(0, 8, 3), b"12345678"), "shape"),
    (answer(row(0, 4, 1), b"1234")[:-1], "ended the connection"),
]


def broken_server(reply):
    listener = socket.create_server(("127.0.0.1", 0))

    def serve():
        while True:
            client, _ = listener.accept()
            client.recv(65536)
            if reply is None:
                client.recv(65536)  # until the client gives up
            else:
                client.sendall(reply)
            client.close()

    threading.Thread(target=serve, daemon=True).start()
    return "{}:{}".format(*listener.getsockname())


def png_size(file):
    """Width and height of a grey PNG whose chunks and pixels are whole."""
    data, at, pixels = file.read_bytes(), 8, b""
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + size]
        if struct.unpack_from(">I", data, at + 8 + size)[0] != zlib.crc32(kind + body):
            return None
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack_from(">IIBB", body)
        pixels += body if kind == b"IDAT" else b""
        at += 12 + size
    return (width, height) if len(zlib.decompress(pixels)) == height * (width + 1) and (depth, colour) == (8, 0) else None


def indented(page):
    return [line.strip() for line in page.read_text().splitlines() if line.startswith("    ")]


environment = {**os.environ, "OBSCURA": obscura}
if language == "java":
    if not shutil.which("java") or not classes:
        skip("no Java Development Kit (Debian package default-jdk-headless)")
    examples = source / "clients" / "java" / "examples"
    first, page = examples / "First.java", source / "docs" / "clients.md"
else:
    if not shutil.which("lua5.4") or subprocess.run(["lua5.4", "-e", 'require "socket.unix"'], capture_output=True).returncode:
        skip("no Lua 5.4 with LuaSocket (Debian packages lua5.4, lua-socket)")
    environment["LUA_PATH"] = f"{source}/clients/lua/?.lua;{source}/clients/lua/?/init.lua;;"
    examples = source / "clients" / "lua" / "examples"
    first, page = examples / "first.lua", source / "docs" / "clients.md"


def run(program, *words, in_folder):
    """The client's test ("test"), or an example ("first", "rendezvous")."""
    if language == "java":
        name = {"test": "obscura.client.ClientTest", "first": "First", "rendezvous": "Rendezvous"}[program]
        command = ["java", "-XX:TieredStopAtLevel=1", f"-Djava.io.tmpdir={in_folder}/tmp", "-cp", classes, name]
    else:
        command = ["lua5.4", source / "tests" / "clients" / "client_test.lua" if program == "test" else examples / f"{program}.lua"]
    (in_folder / "tmp").mkdir(exist_ok=True)
    return subprocess.run([*command, *map(str, words)], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=in_folder,
                          timeout=PATIENCE_S, env={**environment, "TMPDIR": f"{in_folder}/tmp"})


with tempfile.TemporaryDirectory(prefix="obscura-clients-") as temporary:
    folder = pathlib.Path(temporary)
    path = str(folder / "socket")
    server = Child([obscura, "serve", "--listen", "127.0.0.1:0", "--unix", path, "--root", folder, "--with-input"],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    tcp = server.stdout.readline().split()[-1]
    server.stdout.readline()
    for name in ("token", "wrong"):
        (folder / name).write_bytes(os.urandom(32))
        (folder / name).chmod(0o640)
    locked = Child([obscura, "serve", "--listen", "127.0.0.1:0", "--root", folder, "--token-file", folder / "token",
                               "--with-input"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    broken = [f"{broken_server(reply)}={said}" for reply, said in BROKEN]
    with running_daemon(obscurad) as live:
        done = run("test", path if language == "java" else tcp, folder, locked.stdout.readline().split()[-1], live, *broken,
                   in_folder=folder)
    print(done.stdout, end="")
    check("the client's own checks", done.returncode == 0 and "0 checks failed" in done.stdout, f"status {done.returncode}")
    for name in (f"{language}.png", f"{language}-depth.png"):
        check(f"{name} is a picture", png_size(folder / name) == (65, 49))
    for each in (server, locked):
        each.stdin.close()
    check("the servers end well", [each.wait(PATIENCE_S) for each in (server, locked)] == [0, 0])

    done = run("first", in_folder=folder)
    check("the first example runs", done.returncode == 0 and done.stdout.count("640 x 480 px") == 10, done.stdout)
    check("its scene is a scene file", subprocess.run([obscura, "check", folder / "ball.toml"], capture_output=True).returncode == 0)
    shown = [line.strip() for line in first.read_text().splitlines()]
    check("the manual shows it", all(line in indented(page) for line in shown if "camera" in line), page)

    done = run("rendezvous", 3, folder, in_folder=folder)
    depths = [float(depth) for depth in re.findall(r"nearest surface +([\d.]+) m", done.stdout)]
    check("the rendezvous comes nearer", len(depths) == 3 and depths[0] > depths[1] > depths[2] > 15, done.stdout)
    python = subprocess.run([sys.executable, source / "clients" / "python" / "examples" / "rendezvous.py", "3", folder], text=True,
                            capture_output=True, env={**environment, "PYTHONPATH": str(source / "clients" / "python")})
    check("its pictures are those of Python's", done.stdout.splitlines()[-1:] == python.stdout.splitlines()[-1:],
          (done.stdout, python.stdout, python.stderr))
    check("nothing is left behind", not list((folder / "tmp").iterdir()), list((folder / "tmp").iterdir()))

print(f"{len(failures)} checks failed")
sys.exit(1 if failures else 0)
