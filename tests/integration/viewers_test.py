#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Who looks at a camera does not disturb it: in lockstep each step is a frame with the same bytes as without viewers, while some
never read, and obscura-web and readers of the frame ring are stopped and killed. Counts frames and rows, and measures no time.

Usage: viewers_test.py OBSCURAD OBSCURA-WEB SOURCE-DIRECTORY
Exit status 1 if a check failed, 77 without numpy.
"""
import atexit
import contextlib
import json
import pathlib
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

SUPPORT = pathlib.Path(__file__).resolve().parents[1] / "support"
sys.path.insert(0, str(SUPPORT))
from ring_reader import RingReader, obscura_client  # noqa: E402
from simulator_client import Simulator  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402
from web_server import Web  # noqa: E402
from websocket_client import Viewer  # noqa: E402

obscurad, obscura_web, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
PATIENCE_S = 60  # a busy machine, a sanitizer
WIDTH, HEIGHT = 64, 48
COMPARED = 8  # frames of a camera without viewers
KILLS = 3
# Rows are due so long after the edge: time enough to render them, whatever else runs.
EXPOSURE_US = 100_000
ATTEMPTS = 4
failures, processes = [], []
atexit.register(lambda: [process.kill() for process in processes])


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)[:1000]}", flush=True)
    if not good:
        failures.append(what)


def wait_for(condition):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.02)
    return None


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class SteppedCamera:
    """A daemon whose frames come by steps, each half a second of the scene after the one before. Ends it at the end."""

    def __init__(self, exposure_us):
        self.temporary = tempfile.TemporaryDirectory(prefix="obscura-viewers-")
        self.folder, self.answers = pathlib.Path(self.temporary.name), []
        port = free_port()
        self.camera = SmallDaemon(self.folder, obscurad, source, rate_hz=2, trigger='source = "lockstep"', tables=f"""[daemon]
run = 0
[camera]
exposure_us = {exposure_us}
[simulator]
enabled = true
listen = "127.0.0.1:{port}"
""")
        scene = self.folder / "scene.toml"  # of less light, for the exposure
        scene.write_text(scene.read_text().replace("aperture_mm = 25", "aperture_mm = 2"))
        ready = self.folder / "ready"
        self.process = self.camera.start("--ready-file", ready)
        processes.append(self.process)
        wait_for(ready.exists)
        self.simulator = Simulator("127.0.0.1", port)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.simulator.close()
        self.process.terminate()
        self.process.wait(PATIENCE_S)
        self.temporary.cleanup()

    def step(self, count=1):
        """The answer to the last of so many steps; their frames have left, and are in their files, which would not keep up with steps."""
        for _ in range(count):
            self.answers.append(self.simulator.step(0.5 * (len(self.answers) + 1)))
            self.pixels(self.answers[-1].number)
        return self.answers[-1]

    def pixels(self, number):
        """Digital numbers of a frame, from its file."""
        file = self.folder / "frames" / f"frame_{number:06}.raw"
        wait_for(lambda: file.exists() and file.stat().st_size >= 2 * WIDTH * HEIGHT)
        return struct.unpack(f"<{WIDTH * HEIGHT}H", file.read_bytes()[:2 * WIDTH * HEIGHT])

    def late_rows(self):
        return sum(answer.late_rows for answer in self.answers)

    def state(self):
        with obscura_client.connect_camera(self.camera.socket) as monitor:
            return monitor.state()["cameras"][0]


class Watched:
    """obscura-web with viewers of a camera: some see each frame, one never reads."""

    def __init__(self, camera, viewers=3):
        self.camera, self.id = camera, f"{camera.process.pid}-0"
        self.server = Web(obscura_web, "--socket", camera.camera.socket)
        processes.append(self.server.process)
        wait_for(lambda: json.loads(self.server.ask("/api/v1/state").text)["daemons"])
        self.viewers = [self._viewer() for _ in range(viewers)]
        self.silent = self._viewer()

    def _viewer(self):
        viewer = Viewer(self.server.port, self.server.token)
        viewer.view(self.id, max_hz=60)
        return viewer

    def see(self, last):
        """Steps until each viewer has a picture of a frame after `last` with the numbers of its file: the daemon copies frames from the
        first one on that comes after it has been asked. Whether that succeeded. A daemon that answers obscura-web late is "gone" for
        its viewers, who then ask again."""
        waiting, wrong = set(self.viewers), []
        for _ in range(200):
            self.camera.step()
            for viewer in list(waiting):
                if [text for text in viewer.texts if "gone" in text]:
                    viewer.texts.clear()
                    viewer.view(self.id, max_hz=60)
                while picture := viewer.picture_within(0.1):
                    viewer.ready()
                    header, pixels = picture
                    if pixels != self.camera.pixels(header["frame"]):
                        wrong.append(header)
                    if header["frame"] > last:
                        waiting.discard(viewer)
                        break
            if not waiting:
                break
        if waiting or wrong:
            print(f"{len(waiting)} viewers see no frame after {last}, wrong: {wrong}")
        return not waiting and not wrong

    def kill(self):
        self.server.process.kill()
        self.server.process.wait()
        for viewer in self.viewers + [self.silent]:
            viewer.close()


def disturbances(camera):
    """What is done to those who look; between all of it the camera makes steps."""
    for kill in range(KILLS):
        watched = Watched(camera)
        check(f"kill {kill + 1}: viewers see a frame before it", watched.see(len(camera.answers)))
        watched.kill()
        camera.step()
    watched = Watched(camera)
    check("viewers see a frame before the stop", watched.see(len(camera.answers)))
    watched.server.process.send_signal(signal.SIGSTOP)
    last = camera.step(4).number
    watched.server.process.send_signal(signal.SIGCONT)
    check("after the stop viewers see the newest frames", watched.see(last))
    readers = [subprocess.Popen([sys.executable, SUPPORT / "ring_reader.py", camera.camera.socket], stdout=subprocess.PIPE, text=True) for _ in range(2)]
    processes.extend(readers)
    check("readers of the ring read it", all(reader.stdout.readline() for reader in readers if camera.step()))
    readers[0].send_signal(signal.SIGSTOP)
    readers[1].kill()
    readers[1].wait()
    camera.step(6)  # more than the ring has
    readers[0].kill()
    readers[0].wait()
    check("viewers see the newest frames beside dead readers", watched.see(len(camera.answers)))
    watched.kill()


def undisturbed():
    """Frames of a camera without viewers."""
    with SteppedCamera(EXPOSURE_US) as camera:
        camera.step(COMPARED)
        frames = [camera.pixels(answer.number) for answer in camera.answers]
        check("frames show something, each something else", len(set(frames)) == COMPARED and min(len(set(frame)) for frame in frames) > 50)
        return frames


def disturbed(wanted):
    """Late rows of a camera with all of the disturbances."""
    with SteppedCamera(EXPOSURE_US) as camera:
        disturbances(camera)
        numbers = [answer.number for answer in camera.answers]
        check("each step is a frame, in order", numbers == list(range(1, len(numbers) + 1)), numbers)
        counters = camera.state()["camera"]
        counted = {name: counters[name] for name in ("triggers", "frames", "complete")}
        check("no frame is lost", set(counted.values()) == {len(numbers)} and not any(
            counters[name] for name in ("missed_triggers", "dropped", "abandoned", "repeated", "late_dropped", "partial")), counters)
        check("frames are those of a camera at which nobody looks", [camera.pixels(number) for number in numbers[:COMPARED]] == wanted)
        watch = camera.state()["transports"]["watch"]
        check("the transport of viewers has copied or left out each frame that it took", watch["delivered"] + watch["dropped"] == watch["submitted"], watch)
        return camera.late_rows()


def slow_viewer():
    """What a slow viewer sees is no older than the newest frame when it asked: its age is what comes while the picture is on its way."""
    with SteppedCamera(1000) as camera, contextlib.closing(RingReader(camera.camera.socket)) as ring:
        watched = Watched(camera, viewers=1)
        check("a slow viewer sees frames", watched.see(0))
        viewer, ages = watched.viewers[0], []

        def step_into_ring():
            """Steps until the newest frame is in the ring: one that comes while two others wait to be copied is left out."""
            while True:
                number, end = camera.step().number, time.monotonic() + 0.5
                while time.monotonic() < end:
                    ring.watch()
                    if (found := ring.newest()) and found[1]["frame"] == number:
                        return number
                    time.sleep(0.005)

        for busy in (1, 3, 7, 2, 15, 4, 9):
            ring.watch()
            camera.step(busy)  # what it asked for before lies in its socket meanwhile
            while not (got := viewer.picture_within(0.1)):
                camera.step()
            newest = step_into_ring()
            viewer.ready()
            camera.step(busy)
            while not (got := viewer.picture_within(0.1)):
                camera.step()
            header, pixels = got
            check(f"beside {busy} steps: the picture has the numbers of its frame", pixels == camera.pixels(header["frame"]), header)
            ages.append(newest - header["frame"])
            viewer.ready()
        check("a slow viewer's picture is of the frame that was newest when it asked, or later", max(ages) <= 0, ages)
        watched.kill()


wanted = undisturbed()
late = []
while len(late) < ATTEMPTS and (not late or late[-1] > 0):
    late.append(disturbed(wanted))
check("in one run at least no row is late: what makes rows late is the machine", late[-1] == 0, late)
slow_viewer()
sys.exit(1 if failures else 0)
