#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every verb that obscura lists, on a planet with detail: one that takes longer than a second shows its progress, and SIGTERM and SIGINT end it in a second, by the signal and without temporary files.
Usage: verb_times_test.py OBSCURA SOURCE [VERB]..."""
import os
import pathlib
import pty
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

obscura, source = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from checks import check, failures  # noqa: E402

folder = pathlib.Path(tempfile.mkdtemp(prefix="obscura-verbs-"))
LONG_S, MOST_S = 1.0, 1.0
OWN_STATUS = {"batch run": 75, "batch verify": 75}  # by which Slurm queues it again
UNTIL_TOLD = {"serve", "texture mount"}  # their ends are orderly, and they have no progress


def start_s():
    """Seconds that a process takes here to start, do nothing and end."""
    begin = time.monotonic()
    subprocess.run([obscura, "--version"], stdout=subprocess.DEVNULL, check=True)
    return time.monotonic() - begin


def slowness():
    """How much slower a process start is than on an idle machine: what else runs beside the test."""
    return max(1.0, max(start_s() for _ in range(3)) / 0.05)


def silent_socket():
    """A daemon that takes calls and never answers."""
    path = str(folder / "silent.socket")
    server = socket.socket(socket.AF_UNIX)
    server.bind(path)
    server.listen(64)
    held = []

    def take():
        while True:
            try:
                held.append(server.accept()[0])
            except OSError:
                return
    threading.Thread(target=take, daemon=True).start()
    return path


def planet():
    """A scene whose tiles take many seconds."""
    keys = {"width": "2048", "height": "2048", "position_m": "[-1573900, 908700, 0]", "boresight": "[0.433, -0.25, 0.8]", "up": "[-0.866, 0.5, 0]", "focal_length_mm": "20", "aperture_mm": "1.5"}
    lines = [f"{m[1]} = {keys[m[1]]}" if (m := re.match(r"(\w+) = ", line)) and m[1] in keys else line for line in (source / "config/scenes/moon.toml").read_text().splitlines()]
    (folder / "planet.toml").write_text("\n".join(lines) + "\n")
    (folder / "camera.toml").write_text('[scene]\nfile = "planet.toml"\n[gige]\nenabled = false\n[camera]\nexposure_us = 500\n[sensor]\npixel_pitch_um = 8.8\n'
                                        '[sensor.readout]\nwidth = 2048\nheight = 2048\nshutter = "global"\n')


def mesh():
    """A mesh of some million facets, as text."""
    n = 1200
    with open(folder / "grid.obj", "w") as out:
        for i in range(n):
            out.write("".join(f"v {i} {j} {(i * j) % 7}\n" for j in range(n)))
        for i in range(n - 1):
            out.write("".join(f"f {i * n + j + 1} {i * n + j + 2} {i * n + n + j + 1}\nf {i * n + j + 2} {i * n + n + j + 2} {i * n + n + j + 1}\n" for j in range(n - 1)))
    text = (source / "config/scenes/demo.toml").read_text()
    head, _, _ = text.partition("[[body]]")
    (folder / "mesh.toml").write_text(head.replace('catalogue = "', f'catalogue = "{source}/config/scenes/') +
                                      '[[body]]\nname = "grid"\nshape = "mesh"\nfile = "grid.obj"\nmaterial = "lambert"\nalbedo = 0.1\n')


def zero_map(name, edge):
    """A map of zeros as a sparse file."""
    with open(folder / f"{name}.img", "wb") as out:
        out.truncate(2 * edge * edge)
    (folder / f"{name}.lbl").write_text(f'PDS_VERSION_ID = PDS3\r\nRECORD_TYPE = FIXED_LENGTH\r\nRECORD_BYTES = {2 * edge}\r\nFILE_RECORDS = {edge}\r\n^IMAGE = "{name}.img"\r\nOBJECT = IMAGE\r\n'
                                    f' LINES = {edge}\r\n LINE_SAMPLES = {edge}\r\n SAMPLE_TYPE = LSB_INTEGER\r\n SAMPLE_BITS = 16\r\n UNIT = METER\r\nEND_OBJECT = IMAGE\r\nEND\r\n')


planet()
mesh()
zero_map("big", 16384)  # takes the import many seconds
zero_map("small", 1024)
for words in ("import map small.lbl -o small.obt --planar 10", "render demo -o a.png", "render demo -o b.png"):
    subprocess.run([obscura, *words.split()], cwd=folder, capture_output=True)
SILENT = ["--socket", silent_socket()]
# What each verb is asked. A new verb needs a line here.
VERBS = {
    "render": [["planet.toml", "-o", "out/render.exr"], ["mesh.toml", "-o", "out/mesh.exr"], ["planet.toml", "-o", "out/truth.exr", "--truth-table", "out/truth.csv"]],
    "capture": [["camera.toml", "-o", "out", "-n", "2"]],
    "batch plan": [["planet.toml", "-o", "batch", "--frames", "0:4"]],
    "batch run": [["batch"]],
    "batch status": [["batch"]],
    "batch verify": [["batch"]],
    "batch submit": [["batch"]],
    "grab": [["--address", "127.0.0.1", "--frames", "1", "--timeout", "30", "-o", "out"]],
    "check": [["planet.toml"], ["camera.toml"], ["mesh.toml", "--quick"]],
    "keys": [[]],
    "pose": [["planet.toml"], ["mesh.toml"]],
    "new": [["scene"]],
    "examples": [[]],
    "compare": [["a.png", "b.png"]],
    "import flight-image": [["a.fits", "--shape", "grid.obj", "-o", "out/flight.toml"]],
    "import map": [["big.lbl", "-o", "out/big.obt", "--planar", "10"]],
    "import stars": [[str(source / "config/stars/bright.csv"), "-o", "out/stars.osc"]],
    "import ephemeris": [["-o", "out/de405.bsp"]],
    "ephemeris": [["out/none.bsp"]],
    "texture info": [["small.obt"]],
    "texture sample": [["small.obt", "1", "2"]],
    "texture check": [["small.obt"]],
    "texture export": [["small.obt", "-o", "out/none.tif"]],
    "texture bake": [["planet.toml", "-o", "out/baked.obt", "--spacing", "500"]],
    "texture mount": [["small.obt", "mount"]],
    "bench": [["--frames", "100000"]],
    "stimulator": [["list"]],
    "sensor": [["list"], ["flags"], ["maps", "cmv4000", "-o", "out"]],
    "characterise": [["--preset", "cmv4000"]],
    "time": [["2026-01-01T00:00:00Z"]],
    "timing": [[], ["out/none.csv"]],
    "status": [SILENT], "events": [SILENT], "metrics": [SILENT], "get": [SILENT + ["Gain"]], "set": [SILENT + ["Gain=1"]], "features": [SILENT],
    "start": [SILENT], "stop": [SILENT], "trigger": [SILENT], "frame": [SILENT + ["-o", "out/frame.png"]], "probe": [SILENT + ["1", "2"]],
    "scene list": [SILENT], "scene show": [SILENT + ["demo"]], "fault list": [SILENT], "fault add": [SILENT + ["drop"]], "fault clear": [SILENT],
    "support-bundle": [SILENT + ["-o", "out/bundle.tar.zst"]],
    "web": [[]],
    "release": [["--pid", "1"]],
    "truth": [["out/none.fits"]],
    "sky": [["planet.toml", "-o", "out/sky.svg"], ["planet.toml"], ["mesh.toml"]],
    "irradiance": [["mesh.toml", "-o", "out/light.ply"], ["planet.toml"]],
    "model new": [["material", "rock"]],
    "model list": [[]],
    "model show": [["hapke"]],
    "model check": [["hapke"]],
    "model eval": [["akimov", "--at", "incidence=30", "--at", "emission=10"]],
    "model plot": [["hapke", "-o", "out/hapke.png"]],
    "model bench": [["hapke"]],
    "serve": [["--listen", "127.0.0.1:0"]],
}


def left():
    """Files that are neither whole outputs nor what a later call goes on with."""
    return [str(f) for f in folder.rglob("*") if f.name.endswith(".tmp") or f.name.startswith(".obscura")]


def walk(verb, arguments, number):
    """Runs until the verb has ended, or has taken a second and shown progress; then ends it."""
    shutil.rmtree(folder / "out", ignore_errors=True)
    (folder / "out").mkdir()
    name = f"{verb} {' '.join(arguments)}"
    slow = slowness()
    terminal, theirs = pty.openpty()
    begin = time.monotonic()
    process = subprocess.Popen([obscura, *verb.split(), *arguments], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=theirs)
    os.close(theirs)
    said = b""
    os.set_blocking(terminal, False)

    def read():
        nonlocal said
        try:
            said += os.read(terminal, 65536)
        except OSError:
            pass

    # Progress comes within a second more.
    while process.poll() is None and time.monotonic() - begin < (LONG_S + 1) * slow:
        read()
        if time.monotonic() - begin > LONG_S and (b"at work for" in said or b" % " in said or b" %\x1b" in said):
            break
        time.sleep(0.02)
    read()
    ran_s = time.monotonic() - begin
    if process.poll() is not None:
        os.close(terminal)
        if ran_s > 2 * LONG_S * slow:
            check(f"{name}: shows progress", b"at work for" in said or b" %" in said, said)
        return f"ended after {ran_s:.2f} s"
    check(f"{name}: shows progress", verb in UNTIL_TOLD or b"at work for" in said or b" %" in said, said)
    told = time.monotonic()
    process.send_signal(number)
    limit_s = MOST_S * slow + start_s()
    try:
        status = process.wait(timeout=20 * slow)
    except subprocess.TimeoutExpired:
        process.kill()
        status = process.wait()
    took_s = time.monotonic() - told
    limit_s = max(limit_s, MOST_S * slowness() + start_s())
    read()
    os.close(terminal)
    check(f"{name}: ends in {MOST_S} s of {number.name}", took_s < limit_s, f"{took_s:.2f} s, limit {limit_s:.2f} s as loaded")
    wanted = 0 if verb in UNTIL_TOLD else OWN_STATUS.get(verb, -number)
    check(f"{name}: status {wanted} after {number.name}", status == wanted, (status, said[-300:]))
    check(f"{name}: nothing is left", not left(), left())
    return f"long, ended {took_s:.2f} s after {number.name}"


listed = re.findall(r"^  ([a-z-]+(?: [a-z-]+)?)  +\S", subprocess.run([obscura, "--help"], capture_output=True, text=True, check=True).stdout.split("Verbs:\n")[1].split("\n\n")[0], re.M)
check("every verb is walked, and no other", sorted(listed) == sorted(VERBS), set(listed) ^ set(VERBS))
wanted = sys.argv[3:]
subprocess.run([obscura, "batch", "plan", "planet.toml", "-o", "batch", "--frames", "0:4"], cwd=folder, capture_output=True)
long = 0
for k, verb in enumerate(listed):
    if wanted and verb not in wanted:
        continue
    for j, arguments in enumerate(VERBS[verb]):
        if verb == "batch plan":
            arguments = [a if a != "batch" else "other" for a in arguments]
        result = walk(verb, arguments, (signal.SIGTERM, signal.SIGINT)[(k + j) % 2])
        long += result.startswith("long")
        print(f"{verb:20} {' '.join(arguments)[:60]:60} {result}", flush=True)
if not wanted:
    check("some verbs took longer than a second", long >= 8, long)

# Elsewhere than on a terminal: lines.
if not wanted or "render" in wanted:
    process = subprocess.Popen([obscura, "render", "planet.toml", "-o", "out/lines.exr"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    line = process.stderr.readline()
    process.terminate()
    process.wait(timeout=60)
    check("progress in a file is a line", line.endswith("\n") and "\r" not in line and "\x1b" not in line and line.startswith("obscura: render"), repr(line))
shutil.rmtree(folder, ignore_errors=True)
sys.exit(1 if failures else 0)
