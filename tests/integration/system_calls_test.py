#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which system calls the daemon's real-time threads make in steady state: waiting, sending, and nothing else, also while some look at the
camera, arm faults and show another scene.

Usage: system_calls_test.py OBSCURAD OBSCURA OBSCURA-WEB
Exit status 1 if a thread made another call, 77 where it cannot be seen (no strace, ptrace not permitted).
"""
import collections
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

SUPPORT = pathlib.Path(__file__).resolve().parents[1] / "support"
sys.path.insert(0, str(SUPPORT))
import hang_thread  # noqa: E402
import ring_reader as _  # noqa: E402, F401  skips where it cannot run
from children import Child  # noqa: E402
from web_server import Web  # noqa: E402
from websocket_client import Closed, Viewer  # noqa: E402

obscurad, obscura, obscura_web = sys.argv[1:4]
PATIENCE_S = 60
# What each thread may do beside its work: futex is waiting and waking, restart_syscall the kernel's own after a stop.
WAIT = {"futex", "restart_syscall", "sched_yield"}
ALLOWED = {
    "trigger-udp": WAIT | {"ppoll", "recvmsg", "clock_gettime"},
    # An eventfd wakes the video thread; getrusage reads the thread's own processor time for the timing report.
    "pipeline": WAIT | {"write", "getrusage"},
    "detector": WAIT,
    "release": WAIT,
    "gige-stream": WAIT | {"sendmmsg", "sendto", "sendmsg"},
}

if shutil.which("strace") is None:
    print("skipped: strace is not installed")
    sys.exit(77)


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def look(viewer, seen):
    """Sees every picture, until the connection ends."""
    try:
        while True:
            viewer.picture()
            seen.append(viewer)
            viewer.ready()
    except (OSError, Closed, ValueError):
        pass


with tempfile.TemporaryDirectory(prefix="obscura-calls-") as temporary:
    folder = pathlib.Path(temporary)
    port = free_port(socket.SOCK_DGRAM)
    address = f"127.{os.getpid() >> 16 & 127 | 64}.{os.getpid() >> 8 & 255}.{os.getpid() & 255 | 1}"
    client, web, ring_reader, seen = None, None, None, []
    shutil.copy(SUPPORT / "light_scene.toml", folder / "scene.toml")
    (folder / "other.toml").write_text((folder / "scene.toml").read_text().replace("[500, 400, 300]", "[600, 400, 300]"))
    (folder / "obscurad.toml").write_text(f"""[scene]
file = "scene.toml"
[render]
samples_per_pixel = 1
threads = 1
[trigger]
source = "udp"
listen = "127.0.0.1:{port}"
rate_hz = 50
[camera]
exposure_us = 2000
[gige]
interface = "{address}"
[file]
enabled = true
format = "raw"
directory = "{folder}/frames"
[monitor]
socket = "{folder}/monitor"
[control]
unix_socket = "{folder}/calls"
[sensor.readout]
width = 64
height = 64
""")
    with open(folder / "log", "w+", encoding="utf-8") as log:
        daemon = Child([obscurad, "--config", folder / "obscurad.toml"], stdout=subprocess.PIPE, stderr=log)
        try:
            if not daemon.stdout.readline():
                sys.exit("the daemon does not start: " + (folder / "log").read_text())
            sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

            def shoot(count, first):
                for n in range(first, first + count):
                    sender.sendto(b"OBTR" + n.to_bytes(4, "big") + bytes(8), ("127.0.0.1", port))
                    time.sleep(0.02)

            client = Child([obscura, "grab", "--address", address, "--frames", "100000", "--timeout", "60"],
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            first = 1
            while len(list((folder / "frames").glob("*.raw"))) < 5:  # only while the client wants them
                if client.poll() is not None or first > 3000:
                    sys.exit("the client receives nothing: " + (folder / "log").read_text())
                shoot(5, first)
                first += 5
            names = hang_thread.threads(daemon.pid)
            watched = {thread: name for thread, name in names.items() if name in ALLOWED}
            if set(watched.values()) != set(ALLOWED):
                sys.exit(f"threads are missing: {sorted(set(ALLOWED) - set(watched.values()))} of {sorted(names.values())}")
            trace = folder / "trace"
            web = Web(obscura_web, "--socket", str(folder / "monitor"))
            while not json.loads(web.ask("/api/v1/state").text)["daemons"]:
                time.sleep(0.1)
            viewers = [Viewer(web.port, web.token) for _ in range(3)]
            for viewer in viewers:
                viewer.view(f"{daemon.pid}-0", max_hz=60)
            for viewer in viewers[1:]:  # the first one never reads
                threading.Thread(target=look, args=(viewer, seen), daemon=True).start()
            ring_reader = Child([sys.executable, SUPPORT / "ring_reader.py", folder / "monitor"], stdout=subprocess.DEVNULL)
            shoot(30, first)
            first += 30
            strace = Child(["strace", "-qq", "-f", "-o", trace] + [f"-p{thread}" for thread in watched],
                                      stderr=subprocess.PIPE, text=True)
            def traced(thread):
                return "TracerPid:\t0\n" not in pathlib.Path(f"/proc/{daemon.pid}/task/{thread}/status").read_text()
            end = time.monotonic() + PATIENCE_S
            while strace.poll() is None and not all(map(traced, watched)) and time.monotonic() < end:
                time.sleep(0.05)
            if strace.poll() is not None:
                text = strace.stderr.read()
                print(f"skipped: strace: {text.strip().splitlines()[-1] if text.strip() else 'ended'}")
                sys.exit(77)
            before = len(list((folder / "frames").glob("*.raw")))
            looked = len(seen)
            shoot(50, first)
            for words in (["fault", "add", "lose", "percent=5"], ["scene", "show", "other.toml"], ["fault", "clear"]):
                done = subprocess.run([obscura, *words, "--socket", folder / "monitor"], capture_output=True, text=True, timeout=PATIENCE_S)
                if done.returncode != 0:
                    sys.exit(f"{words}: {done.stderr}")
                shoot(20, first + 50)
                first += 20
            end = time.monotonic() + PATIENCE_S
            while len(seen) < looked + 10 and time.monotonic() < end:  # viewers that are slow beside the tracing
                shoot(5, first + 50)
                first += 5
            if len(seen) < looked + 10:
                sys.exit(f"viewers have seen {len(seen) - looked} pictures only")
            strace.send_signal(signal.SIGINT)
            strace.wait(PATIENCE_S)
            after = len(list((folder / "frames").glob("*.raw")))
            if after - before < 10:
                sys.exit(f"only {after - before} frames of 110 triggers while traced")
            calls = collections.defaultdict(collections.Counter)
            for line in trace.read_text(errors="replace").splitlines():
                found = re.match(r"(\d+) +(?:<\.\.\. )?(\w+)(?:\(| resumed)", line)
                if found and int(found[1]) in watched and "resumed" not in line:
                    calls[watched[int(found[1])]][found[2]] += 1
            failed = False
            for name in sorted(ALLOWED):
                others = set(calls[name]) - ALLOWED[name]
                failed = failed or bool(others)
                print(f"{'NOT OK' if others else 'ok'} - {name}: " + ", ".join(f"{c} {n}" for c, n in calls[name].most_common()))
            if not any(calls.values()):
                sys.exit("nothing was seen at all: " + trace.read_text()[:500])
            print(f"{after - before} frames, {len(seen) - looked} pictures for viewers")
            sys.exit(1 if failed else 0)
        finally:
            for process in (client, daemon, ring_reader, web.process if web else None):
                if process:
                    process.kill()
                    process.wait()
