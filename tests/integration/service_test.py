#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The daemon as a service manager sees it: when it says READY, when it feeds the watchdog, what SIGHUP does, how fast it
is back after SIGKILL. No systemd is needed: this program listens on the notification socket itself.

Usage: service_test.py OBSCURAD SOURCE-DIRECTORY [--kills N] [--slowdown N] [TEST...]
Prints a line a check. Exit status 1 if one failed. Checks that the machine does not permit say so.
"""
import argparse
import json
import os
import pathlib
import random
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

SUPPORT = pathlib.Path(__file__).resolve().parents[1] / "support"
sys.path.insert(0, str(SUPPORT))
import hang_thread  # noqa: E402
from children import Child  # noqa: E402

parser = argparse.ArgumentParser()
parser.add_argument("obscurad")
parser.add_argument("source", type=pathlib.Path)
parser.add_argument("--kills", type=int, default=8)
parser.add_argument("--slowdown", type=int, default=1, help="how much slower a sanitizer makes the daemon, about")
parser.add_argument("tests", nargs="*")
options = parser.parse_args()
failures = []
PATIENCE_S = 60  # a busy machine, a sanitizer
WIDTH, HEIGHT = 64, 48


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


class EdgeByEdge(threading.Thread):
    """Sends a trigger datagram, waits for its frame on disk, then sends the next: however busy the machine is, an edge
    without a frame was lost by the daemon."""

    def __init__(self, bench):
        super().__init__(daemon=True)
        self.bench, self.sent, self.lost = bench, 0, False
        self.ending = threading.Event()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            self.address = free.getsockname()

    def table(self):
        """Keys of [trigger]; an edge may come before the chip is ready for it."""
        return f'source = "udp"\nlisten = "{self.address[0]}:{self.address[1]}"\nover_trigger = "latch"'

    def run(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            while not self.ending.is_set() and not self.lost:
                self.sent += 1
                # Letters, sequence number, instant (0: that of arrival), big endian.
                out.sendto(b"OBTR" + struct.pack(">Iq", self.sent, 0), self.address)
                self.lost = not self.bench.wait_frames(self.sent)

    def end(self):
        self.ending.set()
        self.join(2 * PATIENCE_S)


class Bench:
    """A folder with a configuration, a notification socket and at most one daemon."""

    def __init__(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="obscura-service-")
        self.folder = pathlib.Path(self.temporary.name)
        self.frames = self.folder / "frames"
        self.frames.mkdir()
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(self.folder / "notify"))
        self.config = self.folder / "obscurad.toml"
        shutil.copy(SUPPORT / "light_scene.toml", self.folder / "scene.toml")
        self.process = None
        self.write()

    def write(self, exposure_us=2000, more="", samples=1, trigger="rate_hz = 10", size=(WIDTH, HEIGHT)):
        self.config.write_text(f"""[scene]
file = "scene.toml"
[render]
samples_per_pixel = {samples}
threads = 1
[trigger]
{trigger}
[camera]
exposure_us = {exposure_us}
[gige]
enabled = false
[file]
enabled = true
format = "raw"
directory = "{self.frames}"
[sensor.readout]
width = {size[0]}
height = {size[1]}
{more}
""")

    def start(self, watchdog_s=None, abstract=False):
        environment = dict(os.environ, NOTIFY_SOCKET=str(self.folder / "notify"))
        if watchdog_s:
            environment["WATCHDOG_USEC"] = str(int(watchdog_s * 1e6))
        self.log = open(self.folder / "log", "w+", encoding="utf-8")
        self.process = Child(
            [options.obscurad, "--config", self.config, "--stats", self.folder / "stats.json"],
            stdout=subprocess.DEVNULL, stderr=self.log, env=environment)
        return self

    def messages(self, seconds, until=None):
        """[(time, text)] that arrive within `seconds`, or until one contains `until`."""
        found, end = [], time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                text = self.socket.recv(4096).decode()
            except socket.timeout:
                break
            found.append((time.monotonic(), text))
            if until and until in text:
                break
        return found

    def wait_for(self, text, seconds=PATIENCE_S):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if any(text in message for _, message in self.messages(0.2, until=text)):
                return True
            if self.process and self.process.poll() is not None:
                return any(text in message for _, message in self.messages(0.1, until=text))
        return False

    def log_text(self):
        return (self.folder / "log").read_text(encoding="utf-8")

    def complete_frames(self):
        return sorted(f for f in self.frames.rglob("*.raw") if f.stat().st_size >= WIDTH * HEIGHT)

    def wait_frames(self, count, seconds=PATIENCE_S):
        end = time.monotonic() + seconds
        while time.monotonic() < end and self.process.poll() is None:
            if len(self.complete_frames()) >= count:
                return True
            time.sleep(0.01)
        return False

    def stop(self):
        """Ends the daemon; its exit status and counters."""
        self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(PATIENCE_S)
        statistics = json.loads((self.folder / "stats.json").read_text())
        self.process = None
        return status, statistics

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process and self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.socket.close()
        self.temporary.cleanup()


def test_start_and_stop():
    with Bench() as bench:
        bench.start()
        check("READY=1 is said", bench.wait_for("READY=1"), bench.log_text())
        check("frames come", bench.wait_frames(3))
        status, statistics = bench.stop()
        check("SIGTERM ends it with status 0", status == 0)
        check("STOPPING=1 is said", bench.wait_for("STOPPING=1"))
        camera = statistics["camera"]
        check("every trigger of the timer is a frame or counted as missed",
              camera["triggers"] == camera["frames"] + camera["missed_triggers"] + camera["dropped"], camera)
    with Bench() as bench:
        bench.write(more="[nonsense]\nkey = 1")
        bench.start()
        check("a bad configuration is refused with 78", bench.process.wait(PATIENCE_S) == 78)
        check("and READY=1 is not said", not bench.messages(0.2))
        check("but one line", bench.log_text().count("\n") == 1 and str(bench.config) in bench.log_text(), bench.log_text())


SLOW_GROUND = """name = "ground"
[sun]
direction = [0.4, 1, 0.2]
distance_au = 1
[camera]
focal_length_mm = 10
aperture_mm = 5
position_m = [1797400, 0, 0]
boresight = [-0.3, 1, 0]
up = [1, 0, 0]
[[body]]
name = "moon"
shape = "planet"
radii_m = [1737400, 1737400, 1737400]
albedo = 0.2
cell_px = %g
[body.detail]
terrain = "highlands"
crater_age_ga = 3.9
crater_least_m = 20
"""


def test_tiles():
    """The ground that the first frame shows is made before triggers are taken; that can be broken off."""
    with Bench() as bench:
        (bench.folder / "scene.toml").write_text(SLOW_GROUND % 0.1)
        bench.start(watchdog_s=30)
        said = [text for _, text in bench.messages(PATIENCE_S, until="EXTEND_TIMEOUT_USEC=")]
        check("it asks for more time and feeds the watchdog", any("WATCHDOG=1" in text for text in said), said)
        check("and does not say READY=1", not any("READY=1" in text for text in said), said)
        check("nor sends frames", not bench.complete_frames())
        begin = time.monotonic()
        bench.process.send_signal(signal.SIGTERM)
        status = bench.process.wait(PATIENCE_S)
        check("SIGTERM ends it with status 0", status == 0, bench.log_text())
        check("because it was asked to", "stopped while" in bench.log_text(), bench.log_text())
        print(f"figure - SIGTERM to exit while tiles are made: {time.monotonic() - begin:.3f} s")
    with Bench() as bench:
        (bench.folder / "scene.toml").write_text(SLOW_GROUND % 2)
        bench.start()
        check("READY=1 is said", bench.wait_for("READY=1", 3 * PATIENCE_S), bench.log_text())
        check("once the tiles are there", "made for the first frame" in bench.log_text(), bench.log_text())
        check("frames come", bench.wait_frames(3))
        status, statistics = bench.stop()
        check("SIGTERM ends it with status 0", status == 0)
        print("figure - tiles missing in", statistics["camera"].get("lod_deficit"))


def test_long_rendering():
    """A frame that takes far longer than the watchdog is work, not a hung worker."""
    watchdog_s = 2
    with Bench() as bench:
        # Some 30 s of work for a fast core, with most of the body in the picture.
        bench.write(samples=65536 // options.slowdown, size=(4 * WIDTH, 4 * HEIGHT))
        bench.start(watchdog_s=watchdog_s)
        check("READY=1 is said", bench.wait_for("READY=1"), bench.log_text())
        fed = [t for t, text in bench.messages(4 * watchdog_s) if "WATCHDOG=1" in text]
        check("the watchdog is fed while one frame is rendered",
              len(fed) >= 4 and max(b - a for a, b in zip(fed, fed[1:])) < watchdog_s, fed)
        check("and no frame was ready", not bench.complete_frames())


def test_watchdog():
    """The watchdog is fed while all is well, and not when any worker stands still."""
    watchdog_s = 1.2
    supervised = {"detector", "pipeline", "release", "alarm", "trigger-timer", "file-sink", "v4l2-output", "stimulator"}
    with Bench() as bench:
        # Devices that are not there: their threads look for them, and owe signs of life all the same.
        bench.write(more='[v4l2]\nenabled = true\ndevice = "/dev/not-there"\n[stimulator]\nenabled = true\nserial = "none"')
        bench.start(watchdog_s=watchdog_s)
        check("READY=1 is said", bench.wait_for("READY=1"), bench.log_text())
        bench.wait_frames(2)
        fed = [t for t, text in bench.messages(3 * watchdog_s) if "WATCHDOG=1" in text]
        gaps = [b - a for a, b in zip(fed, fed[1:])]
        check(f"fed {len(fed)} times in {3 * watchdog_s} s, longest gap {max(gaps, default=99):.2f} s", len(fed) >= 2)
        names = set(hang_thread.threads(bench.process.pid).values()) - {"obscurad"}
        check("the workers have their names", supervised <= names, names)
        try:
            for name in sorted(names):
                # A thread caught in a call for which it announced silence, such as a search for a device, may be
                # silent there: it is caught again elsewhere.
                for _ in range(4):
                    with hang_thread.Hung(bench.process.pid, name):
                        # What was noted before it stood still may feed it once more.
                        bench.messages(watchdog_s)
                        late = [text for _, text in bench.messages(1.2 * watchdog_s) if "WATCHDOG=1" in text]
                    if not late or name not in supervised:
                        break
                    time.sleep(0.1)
                if name not in supervised:
                    continue  # libusb's
                check(f"thread '{name}' hangs: not fed", not late, late)
                check(f"thread '{name}' goes on: fed again", bench.wait_for("WATCHDOG=1", 10 * watchdog_s))
        except hang_thread.NotPermitted as error:
            print(f"skipped - hanging threads: ptrace: {error}")
        status, _ = bench.stop()
        check("it still ends well", status == 0)


def test_reload():
    """Forty reloads, good and bad, of scene, late policy and log level while frames flow: none is lost, none repeated."""
    with Bench() as bench:
        edges = EdgeByEdge(bench)

        def write(**changes):
            bench.write(trigger=edges.table(), **changes)

        scene = (bench.folder / "scene.toml").read_text()
        write()
        bench.start(watchdog_s=5)
        check("READY=1 is said", bench.wait_for("READY=1"), bench.log_text())
        edges.start()
        bench.wait_frames(3)
        first = bench.complete_frames()[0].read_bytes()
        for number in range(40):
            kind = number % 4
            if kind == 0:  # something else to see
                (bench.folder / "scene.toml").write_text(
                    scene.replace("radii_m = [500, 400, 300]", f"radii_m = [{500 + 10 * number}, 900, 900]"))
            elif kind == 1:
                write(more=f'[deadline]\npolicy = "{["late", "repeat"][number // 4 % 2]}"\ngrace_us = 2e6')
            elif kind == 2:  # no scene at all
                (bench.folder / "scene.toml").write_text(scene + "nonsense = 1\n")
            else:  # needs a restart
                (bench.folder / "scene.toml").write_text(scene)
                write(exposure_us=2500)
            bench.process.send_signal(signal.SIGHUP)
            said = bench.wait_for("RELOADING=1") and bench.wait_for("READY=1")
            if not said:
                check(f"reload {number} is answered", False, bench.log_text())
                break
            if kind == 3:
                write()
        count = len(bench.complete_frames())
        bench.wait_frames(count + 3)
        edges.end()
        status, statistics = bench.stop()
        camera, log = statistics["camera"], bench.log_text()
        check("it ends well", status == 0, log)
        taken, refused = log.count("taken on"), log.count("nothing changed")
        check("20 good ones are taken on, 20 bad ones change nothing", (taken, refused) == (20, 20), (taken, refused, log))
        lost = {key: camera[key] for key in ("missed_triggers", "dropped", "abandoned", "late_dropped") if camera[key]}
        check("every edge is a frame", not edges.lost and camera["frames"] == edges.sent, (edges.sent, camera))
        check("no frame is lost", not lost, lost)
        names = [f.name for f in bench.complete_frames()]
        check("one numbering without a gap", names == [f"frame_{n:06}.raw" for n in range(1, len(names) + 1)], names[:3])
        check("the new scene is seen", any(f.read_bytes() != first for f in bench.complete_frames()[-30:]))


def test_kill():
    """SIGKILL at random instants: back with a frame soon, and nothing half-written is left under a final name."""
    random.seed(1)
    times = []
    with Bench() as bench:
        for _ in range(options.kills):
            for file in bench.complete_frames():
                file.unlink()
            begin = time.monotonic()
            bench.start()
            if not bench.wait_frames(1):
                break
            times.append(time.monotonic() - begin)
            time.sleep(random.random() * 0.3)
            bench.process.kill()
            bench.process.wait()
        check(f"{len(times)} of {options.kills} SIGKILLs survived", len(times) == options.kills, bench.log_text())
        sizes = {f.stat().st_size for f in bench.frames.rglob("*.raw")}
        check("no frame is cut short", len(sizes) == 1, sizes)
        times.sort()
        print(f"figure - start to first frame: median {times[len(times) // 2]:.3f} s, worst {times[-1]:.3f} s")


tests = {name.removeprefix("test_"): function for name, function in list(globals().items()) if name.startswith("test_")}
for name in options.tests or tests:
    print(f"# {name}", flush=True)
    tests[name]()
sys.exit(1 if failures else 0)
