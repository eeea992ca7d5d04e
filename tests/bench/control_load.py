#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What programs that call a running camera cost it: a daemon at 10 Hz alone, then while clients ask it for its state all the time, some
watch its frames, and one renders on a server beside it. Prints late rows and how late rows left, of each as a row of a Markdown table.

Usage: control_load.py OBSCURAD OBSCURA [--clients N] [--watchers N] [--seconds S] [--rounds N]
The two are measured in turns, so that what else runs on the machine falls on both. Late rows are those that were not ready in time; stalled
ones left more than a millisecond late, because the system did not run the thread that releases them.
"""
import argparse
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "clients" / "python"))
import obscura_client  # noqa: E402
from loaded_camera import at, row_lateness, write_config  # noqa: E402


class Load:
    """Clients of the daemon, in programs of their own: each asks again as soon as it is answered."""

    def __init__(self, options, path):
        def program(text):
            return subprocess.Popen([sys.executable, "-c", text], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                                    env={**os.environ, "PYTHONPATH": str(ROOT / "clients" / "python"), "OBSCURA": options.obscura})

        many = options.clients
        self.programs = [program(f"""
import sys, threading, obscura_client
stop, counts = threading.Event(), []
def ask(camera):
    n = 0
    while not stop.is_set():
        camera.state(); n += 1
    counts.append(n)
threads = [threading.Thread(target=ask, args=(obscura_client.connect_camera({path!r}),)) for _ in range({many})]
for t in threads: t.start()
sys.stdin.read(); stop.set()
for t in threads: t.join()
print(sum(counts))
"""), program("""
import sys, threading, obscura_client
stop = threading.Event()
threading.Thread(target=lambda: (sys.stdin.read(), stop.set()), daemon=True).start()
n = 0
with obscura_client.start("demo") as server:
    while not stop.is_set():
        server.render(float(n), size=(512, 512), samples=16); n += 1
print(n)
""")] + [program(f"""
import sys, threading, obscura_client
stop = threading.Event()
threading.Thread(target=lambda: (sys.stdin.read(), stop.set()), daemon=True).start()
n = 0
for frame in obscura_client.connect_camera({path!r}).frames():
    n += 1
    if stop.is_set(): break
print(n)
""") for _ in range(options.watchers)]

    def stop(self):
        return [int(program.communicate()[0] or 0) for program in self.programs]


def measure(options, loaded):
    with tempfile.TemporaryDirectory(prefix="obscura-load-") as folder:
        write_config(f"{folder}/obscurad.toml", 256, f"""[monitor]
socket = "off"
[control]
unix_socket = "{folder}/calls"
clients = 200""")
        daemon = subprocess.Popen([options.obscurad, "--config", f"{folder}/obscurad.toml", "--timing", f"{folder}/timing.csv"],
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        daemon.stdout.readline()  # ready
        camera = obscura_client.connect_camera(f"{folder}/calls")
        load = Load(options, f"{folder}/calls") if loaded else None
        time.sleep(2)
        before = camera.state()["cameras"][0]["camera"]
        threading.Event().wait(options.seconds)
        after = camera.state()["cameras"][0]["camera"]
        answers = load.stop() if load else []
        camera.close()
        daemon.send_signal(signal.SIGTERM)
        daemon.wait()
        counts = {name: after[name] - before[name] for name in ("complete", "late", "late_rows", "stalled_rows")}
        return counts, row_lateness(f"{folder}/timing.csv"), answers


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("obscurad")
    arguments.add_argument("obscura")
    arguments.add_argument("--clients", type=int, default=100)
    arguments.add_argument("--watchers", type=int, default=1)
    arguments.add_argument("--seconds", type=float, default=20)
    arguments.add_argument("--rounds", type=int, default=2)
    options = arguments.parse_args()
    print("| clients | load average | frames | late frames | late rows | stalled rows | rows after their time: p50 | p99 | p99.9 | states, pictures, "
          "frames answered |\n|---|---|---|---|---|---|---|---|---|---|")
    for turn in range(2 * options.rounds):
        counts, lateness, answers = measure(options, turn % 2 == 1)
        print(f"| {f'{options.clients} + {options.watchers} + 1' if turn % 2 else 'none'} | {os.getloadavg()[0]:.1f} | {counts['complete']} "
              f"| {counts['late']} | {counts['late_rows']} | {counts['stalled_rows']} | {at(lateness, 0.5):.2f} us | {at(lateness, 0.99):.2f} us "
              f"| {at(lateness, 0.999):.2f} us | {', '.join(map(str, answers))} |", flush=True)


main()
