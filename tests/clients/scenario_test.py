#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One scenario in the languages of all clients: each must print the same digests of light, depth and scene file, and the same
refusal. One server; half of the clients come over TCP, half over its Unix socket, and Python over both.

Usage: scenario_test.py OBSCURA SOURCE-DIRECTORY [--program LANGUAGE=FILE]...
LANGUAGE: java (folder of compiled classes), octave (folder of the MEX function), c, c++ (programs). Says which languages were skipped. Exit status 1 if a client
differs, 77 without numpy.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402

try:
    import numpy  # noqa: F401
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)

PATIENCE_S = 120
obscura, source = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
programs = dict(word.split("=", 1) for word in sys.argv[3:] if "=" in word)
here = source / "tests" / "clients"
failures = 0


def lua_has_sockets():
    return shutil.which("lua5.4") and subprocess.run(["lua5.4", "-e", 'require "socket.unix"'], capture_output=True).returncode == 0


# Language, why it is skipped (false: it is not), command, environment, whether it comes over TCP.
LANGUAGES = [
    ("Python", False, [sys.executable, here / "scenario.py"], {"PYTHONPATH": source / "clients" / "python"}, True),
    ("Python", False, [sys.executable, here / "scenario.py"], {"PYTHONPATH": source / "clients" / "python"}, False),
    ("Java", not (shutil.which("java") and "java" in programs) and "no Java Development Kit (Debian package default-jdk-headless)",
     ["java", "-Xshare:auto", "-cp", programs.get("java"), "Scenario"], {}, True),
    ("Lua", not lua_has_sockets() and "no Lua 5.4 with LuaSocket (Debian packages lua5.4, lua-socket)",
     ["lua5.4", here / "scenario.lua"], {"LUA_PATH": f"{source}/clients/lua/?.lua;{source}/clients/lua/?/init.lua;;"}, False),
    ("C", "c" not in programs and "no program was given", [programs.get("c")], {}, True),
    ("Octave", "octave" not in programs and "no Octave with its development files (Debian package octave-dev)",
     ["octave-cli", "--no-init-file", "--path", source / "clients" / "octave", "--path", programs.get("octave"), here / "scenario.m"],
     {}, True),
    ("C++", "c++" not in programs and "no program was given", [programs.get("c++")], {}, False),
]

with tempfile.TemporaryDirectory(prefix="obscura-scenario-") as folder:
    path = os.path.join(folder, "socket")
    server = Child([obscura, "serve", "--listen", "127.0.0.1:0", "--unix", path, "--root", folder, "--with-input"],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    tcp, _ = [server.stdout.readline().split()[-1] for _ in range(2)]
    wanted = None
    for language, skipped, command, environment, over_tcp in LANGUAGES:
        if skipped:
            print(f"skipped - {language}: {skipped}")
            continue
        done = subprocess.run([*command, tcp if over_tcp else path], capture_output=True, text=True, timeout=PATIENCE_S, cwd=folder,
                              env={**os.environ, **{name: str(value) for name, value in environment.items()}})
        wanted = wanted or done.stdout
        good = done.returncode == 0 and done.stdout == wanted
        failures += not good
        print(f"{'ok' if good else 'NOT OK'} - {language} over {'TCP' if over_tcp else 'the Unix socket'}")
        if not good:
            print(f"  status {done.returncode}\n{done.stdout}{done.stderr}  wanted:\n{wanted}")
    server.stdin.close()
    server.wait(PATIENCE_S)

# What the first client printed is what the scenario asks for: a disc of light, and its depth.
sha = "[0-9a-f]{64}"
shape = re.compile(rf"values {sha}\ndepth {sha}\nlit (\d+)\nseen (\d+)\nrefused bad-scene body\[0\]\.albedo 0 to 1\n"
                   rf"values {sha}\ndepth {sha}\nlit (\d+)\nseen (\d+)\ndn {sha}\nsum \d+\nexport {sha}\n")
found = shape.fullmatch(wanted or "")
if found and 500 < int(found[2]) < int(found[4]) and int(found[1]) >= int(found[2]) // 2:
    print("ok - the second picture is of a nearer ball")
else:
    print(f"NOT OK - this is no run of the scenario:\n{wanted}")
    failures += 1
sys.exit(1 if failures else 0)
