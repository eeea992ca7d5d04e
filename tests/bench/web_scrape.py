#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Time that obscura-web takes for a scrape of /metrics, beside viewers of state and log.

Usage: web_scrape.py OBSCURAD OBSCURA-WEB [--scrapes 1000] [--viewers 8]
Prints the processor time of the server for a scrape (difference of its clock over all scrapes, viewers excluded by a run without
them), and the time of a scrape as the client sees it: median, p99, largest. Counters of all scrapes must not go back. Exit status
1 if one does.
"""
import argparse
import http.client
import os
import pathlib
import re
import sys
import tempfile
import threading
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "tests/support"))
from small_daemon import SmallDaemon  # noqa: E402
from web_server import Web  # noqa: E402

parser = argparse.ArgumentParser(usage=__doc__)
parser.add_argument("obscurad")
parser.add_argument("web")
parser.add_argument("--scrapes", type=int, default=1000)
parser.add_argument("--viewers", type=int, default=8)
options = parser.parse_args()


def cpu_s(process):
    """Processor time of a process by the scheduler's account, s."""
    return sum(int((task / "schedstat").read_text().split()[0]) for task in pathlib.Path(f"/proc/{process.pid}/task").iterdir()) / 1e9


def counters(text):
    return {m[1]: float(m[2]) for m in re.finditer(r"^(\w+_total(?:{[^}]*})?) (\S+)$", text, re.M)}


def scrape(server, count):
    """Times, s, and whether no counter went back."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port)
    times, before, forward = [], {}, True
    for _ in range(count):
        begun = time.monotonic()
        connection.request("GET", "/metrics", headers={"Authorization": f"Bearer {server.token}"})
        text = connection.getresponse().read().decode()
        times.append(time.monotonic() - begun)
        now = counters(text)
        forward = forward and all(value >= before.get(name, 0) for name, value in now.items())
        before = now
        time.sleep(0.002)
    return sorted(times), forward, len(text)


with tempfile.TemporaryDirectory() as folder:
    camera = SmallDaemon(folder, options.obscurad, SOURCE)
    daemon = camera.start()
    server = Web(options.web, "--socket", camera.socket)
    while "obscura_frames_total" not in server.ask("/metrics").text:
        time.sleep(0.2)
    stop = threading.Event()

    def look():
        while not stop.wait(0.5):
            server.ask("/api/v1/state")
            server.ask("/api/v1/events?follow=0")

    begun, idle = time.monotonic(), cpu_s(server.process)
    time.sleep(2)
    idle = (cpu_s(server.process) - idle) / (time.monotonic() - begun)
    begun, used = time.monotonic(), cpu_s(server.process)
    _, forward_alone, size = scrape(server, options.scrapes)
    used = cpu_s(server.process) - used - idle * (time.monotonic() - begun)
    viewers = [threading.Thread(target=look) for _ in range(options.viewers)]
    for viewer in viewers:
        viewer.start()
    times, forward, _ = scrape(server, options.scrapes)
    stop.set()
    for viewer in viewers:
        viewer.join()
    print(f"load {os.getloadavg()[0]:.1f}; {size} bytes a scrape; {1e3 * used / options.scrapes:.3f} ms of processor time each")
    print(f"beside {options.viewers} viewers: median {1e3 * times[len(times) // 2]:.2f} ms, p99 {1e3 * times[int(0.99 * len(times))]:.2f} ms, largest {1e3 * times[-1]:.2f} ms; "
          f"resident {server.resident_mib():.1f} MiB")
    server.end()
    daemon.terminate()
    daemon.wait()
sys.exit(0 if forward and forward_alone else 1)
