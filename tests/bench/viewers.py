#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What viewers of live pictures cost a camera: a daemon at 10 Hz with obscura-web and no viewer, one, 20, and 4 more that never read; with a
stopped obscura-web, and one that is killed and started again and again. Prints late rows, how late rows left, and processor time of both
processes, of each as a row of a Markdown table.

Usage: viewers.py OBSCURAD OBSCURA-WEB [--seconds S] [--size N] [--kills N] [--rounds N] [--only ROW] [--own-core]
With --own-core the thread that releases rows has core 1 for itself, and everything else, with obscura-web and the viewers, core 0. Rows take
turns with runs without viewers, so that what else the machine does falls on both; the medians over the rounds, and their ratio, come last.
Late rows are those that were not ready in time; stalled ones left more than a millisecond late, because the system did not run the thread that
releases them. Each viewer sees the whole image at full resolution, up to 10 pictures a second; the budget of obscura-web lowers that.
"""
import argparse
import json
import os
import pathlib
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
from loaded_camera import at, row_lateness, write_config  # noqa: E402
from websocket_client import Closed, Viewer  # noqa: E402


def look(port, token, camera, readers, silent):
    """Program of its own: viewers until its input ends; prints the pictures that each has got."""
    counts, stop = [0] * readers, threading.Event()

    def one(i):
        try:
            viewer = Viewer(port, token, source=f"127.0.0.{2 + i // 8}")
            viewer.view(camera, max_hz=10)
            while not stop.is_set() and i < readers:
                viewer.picture(timeout=5)
                counts[i] += 1
                viewer.ready()
            stop.wait()
        except (OSError, Closed):
            pass

    threads = [threading.Thread(target=one, args=(i,), daemon=True) for i in range(readers + silent)]
    for thread in threads:
        thread.start()
    sys.stdin.read()
    stop.set()
    print(json.dumps(counts))


def cpu_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def others(options):
    """Words before a command that keep it off the core of the release thread."""
    return ["taskset", "-c", "0"] if options.own_core else []


THREADS = """[threads]
release_cores = "1"
trigger_cores = "0"
transmit_cores = "0"
detector_cores = "0"
pipeline_cores = "0"
display_cores = "0"
render_cores = "0"
"""


class Web:
    def __init__(self, options, folder):
        command = [options.web, "--listen", "127.0.0.1:0", "--socket", f"{folder}/monitor"]
        command = others(options) + command
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        link = self.process.stdout.readline()
        self.port, self.token = int(link.split(":")[2].split("/")[0]), link.strip().partition("token=")[2]

    def state(self):
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}/api/v1/state", headers={"Authorization": f"Bearer {self.token}"})
        with urllib.request.urlopen(request, timeout=10) as answer:
            return json.load(answer)["daemons"]

    def end(self):
        self.process.kill()
        self.process.wait()


ROWS = {"one": {"readers": 1}, "20": {"readers": 20}, "20 and 4 that never read": {"readers": 20, "silent": 4},
        "20, stopped": {"readers": 20, "stopped": True}, "killed": {"readers": 1}}
p999, late = {}, {}  # of each row, one value a round


def measure(options, name, readers=0, silent=0, stopped=False, kills=0):
    with tempfile.TemporaryDirectory(prefix="obscura-viewers-") as folder:
        write_config(f"{folder}/obscurad.toml", options.size, 
                     "[monitor]\nsocket = " + json.dumps(f"{folder}/monitor") + "\n" + (THREADS if options.own_core else ""))
        daemon = subprocess.Popen([options.obscurad, "--config", f"{folder}/obscurad.toml", "--timing", f"{folder}/timing.csv"],
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        daemon.stdout.readline()  # ready
        web = Web(options, folder)
        while not web.state():
            time.sleep(0.2)

        def start_viewers():
            return subprocess.Popen(others(options) + [sys.executable, __file__, "--look", str(web.port), web.token, f"{daemon.pid}-0", str(readers), str(silent)],
                                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) if readers + silent else None

        viewers = start_viewers()
        time.sleep(3)
        before = web.state()[0]["cameras"][0]["camera"]
        cpu = [cpu_s(daemon.pid), cpu_s(web.process.pid)]
        begin, back = time.monotonic(), []
        if stopped:
            web.process.send_signal(signal.SIGSTOP)
        for _ in range(kills):
            time.sleep(0.3)
            viewers.stdin.close()
            viewers.wait()
            web.end()
            killed = time.monotonic()
            web = Web(options, folder)
            viewers = start_viewers()
            while not web.state():
                time.sleep(0.05)
            back.append(time.monotonic() - killed)
        time.sleep(max(0.0, begin + options.seconds - time.monotonic()))
        if stopped:
            web.process.send_signal(signal.SIGCONT)
            time.sleep(1)
        span = time.monotonic() - begin
        used = [100 * (cpu_s(pid) - was) / span for pid, was in zip((daemon.pid, web.process.pid), cpu)]
        counts = json.loads(viewers.communicate()[0] or "[]") if viewers else []
        after = web.state()[0]["cameras"][0]["camera"]
        web.end()
        daemon.send_signal(signal.SIGTERM)
        daemon.wait()
        lateness = row_lateness(f"{folder}/timing.csv")
        p999.setdefault(name, []).append(at(lateness, 0.999))
        late.setdefault(name, []).append(after["late_rows"] - before["late_rows"])
        did = {key: after[key] - before[key] for key in ("complete", "late", "late_rows", "stalled_rows")}
        rate = f"{min(counts) / (span + 3):.1f}" if counts else "-"
        web_cpu = f"{used[1]:.1f} %" if not kills else "-"
        notes = f", back after {max(back):.1f} s at most" if back else ""
        print(f"| {name}{notes} | {os.getloadavg()[0]:.1f} | {did['complete']} | {did['late']} | {did['late_rows']} | {did['stalled_rows']} "
              f"| {at(lateness, 0.5):.2f} us | {at(lateness, 0.99):.2f} us | {at(lateness, 0.999):.2f} us | {used[0]:.1f} % | {web_cpu} | {rate} |",
              flush=True)


def main():
    if sys.argv[1:2] == ["--look"]:
        look(int(sys.argv[2]), sys.argv[3], sys.argv[4], int(sys.argv[5]), int(sys.argv[6]))
        return
    arguments = argparse.ArgumentParser()
    arguments.add_argument("obscurad")
    arguments.add_argument("web")
    arguments.add_argument("--seconds", type=float, default=20)
    arguments.add_argument("--size", type=int, default=512)
    arguments.add_argument("--kills", type=int, default=100)
    arguments.add_argument("--rounds", type=int, default=2)
    arguments.add_argument("--only", choices=list(ROWS), help="this row, in turns with none")
    arguments.add_argument("--own-core", action="store_true")
    options = arguments.parse_args()
    print("| viewers | load average | frames | late frames | late rows | stalled rows | rows after their time: p50 | p99 | p99.9 | obscurad | obscura-web "
          "| pictures/s, the slowest |\n|---|---|---|---|---|---|---|---|---|---|---|---|")
    for turn in range(options.rounds):
        measure(options, "none")
        for name, how in ROWS.items():
            if options.only not in (None, name) or (name == "killed" and turn > 0):
                continue
            measure(options, name, **({**how, "kills": options.kills} if name == "killed" else how))
    print("\n| viewers | late rows, all rounds | p99.9, median of the rounds | ratio to none |\n|---|---|---|---|")
    alone = statistics.median(p999["none"])
    for name, values in p999.items():
        print(f"| {name} | {sum(late[name])} | {statistics.median(values):.2f} us | {statistics.median(values) / alone:.2f} |")


main()
