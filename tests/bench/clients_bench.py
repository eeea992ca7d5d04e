#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What calls of the rendering server cost its clients in Java and Lua, beside bare sockets of the same language in the same run.

Prints what serve_bench.py prints of the Python client, for TCP and the Unix socket, of the languages that are installed. No
verdict.

Usage: clients_bench.py OBSCURA [REPEATS]    (in the source tree, after the build)
"""
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile

from bare_sockets import EchoServer

obscura, repeats = os.path.abspath(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "2000"
here, source = pathlib.Path(__file__).resolve().parent, pathlib.Path(__file__).resolve().parents[2]
archive = pathlib.Path(obscura).parents[1] / "clients" / "java" / "obscura-client.jar"
environment = {**os.environ, "LUA_PATH": f"{source}/clients/lua/?.lua;{source}/clients/lua/?/init.lua;;"}
languages = {}
if shutil.which("java") and archive.exists():
    languages["Java"] = ["java", "-cp", archive, here / "ClientBench.java"]
if shutil.which("lua5.4"):
    languages["Lua"] = ["lua5.4", here / "client_bench.lua"]

with tempfile.TemporaryDirectory(prefix="obscura-bench-") as folder:
    path = os.path.join(folder, "socket")
    server = subprocess.Popen([obscura, "serve", "--listen", "127.0.0.1:0", "--unix", path, "--root", folder, "--with-input"],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    addresses = [server.stdout.readline().split()[-1] for _ in range(2)]
    for language, command in languages.items():
        for family, address in zip((socket.AF_INET, socket.AF_UNIX), addresses):
            print(f"{language}, {'TCP' if family == socket.AF_INET else 'Unix socket'}, load {os.getloadavg()[0]:.1f}", flush=True)
            with EchoServer(family) as echo:
                subprocess.run([*command, address, echo.address, repeats], check=True, env=environment)
    server.stdin.close()
    server.wait()
