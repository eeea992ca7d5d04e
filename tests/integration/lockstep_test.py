#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Another program moves the scene and makes the steps: frames follow its poses, the same every time, and no bytes of
its do harm.

Usage: lockstep_test.py OBSCURAD SOURCE-DIRECTORY
Exit status 1 if a check failed.
"""
import json
import math
import pathlib
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402
from own_address import own_address  # noqa: E402
from simulator_client import Refused, Simulator  # noqa: E402

obscurad = sys.argv[1]
failures = []
PATIENCE_S = 60
SIZE = 64


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def refusal(action):
    try:
        action()
    except Refused as error:
        return str(error)
    return ""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Daemon:
    def __init__(self, source="lockstep", policy="late", quality="hold", token=None, host="127.0.0.1"):
        self.temporary = tempfile.TemporaryDirectory(prefix="obscura-lockstep-")
        self.folder = pathlib.Path(self.temporary.name)
        self.port = free_port()
        (self.folder / "scene.toml").write_text(
            """[sun]
direction = [-1, 0, 0.3]
distance_au = 1
[camera]
focal_length_mm = 50
aperture_mm = 25
psf_sigma_px = 0.5
position_m = [-20000, 0, 0]
boresight = [1, 0, 0]
up = [0, 0, 1]
[[body]]
name = "rock"
shape = "ellipsoid"
radii_m = [100, 60, 40]
albedo = 0.3
""")
        if token:
            (self.folder / "sim.token").write_bytes(token)
            (self.folder / "sim.token").chmod(0o640)
        (self.folder / "obscurad.toml").write_text(f"""[scene]
file = "scene.toml"
[render]
samples_per_pixel = 4
[trigger]
source = "{source}"
rate_hz = 20
[deadline]
policy = "{policy}"
quality = "{quality}"
reserve_us = 1000000
[simulator]
enabled = true
listen = "{host}:{self.port}"
{'token_file = "sim.token"' if token else ""}
[camera]
exposure_us = 1000
[gige]
enabled = false
[file]
enabled = true
format = "raw"
directory = "frames"
queue_frames = 32
[daemon]
run = 0
pool_frames = 48
[sensor]
pixel_pitch_um = 18
[sensor.readout]
width = {SIZE}
height = {SIZE}
""")
        self.log = open(self.folder / "log", "w+", encoding="utf-8")
        self.process = Child([obscurad, "--config", self.folder / "obscurad.toml", "--stats", self.folder / "stats.json"],
                                        stdout=subprocess.PIPE, stderr=self.log)
        self.process.stdout.readline()  # ready

    def log_text(self):
        return (self.folder / "log").read_text(encoding="utf-8")

    def frame(self, number):
        """Digital numbers of a frame that has left; the file is written a little later."""
        file = self.folder / "frames" / f"frame_{number:06}.raw"
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            if file.exists() and file.stat().st_size >= 2 * SIZE * SIZE:
                return struct.unpack(f"<{SIZE * SIZE}H", file.read_bytes()[:2 * SIZE * SIZE])
            time.sleep(0.005)
        raise TimeoutError(file)

    def cards(self, number):
        """Numbers of the file beside the frame."""
        file = self.folder / "frames" / f"frame_{number:06}.toml"
        end = time.monotonic() + PATIENCE_S
        while not (file.exists() and "B0_AGE" in file.read_text()) and time.monotonic() < end:
            time.sleep(0.005)
        lines = [line.split("#")[0].partition(" = ") for line in file.read_text().splitlines()]
        return {key: float(value) for key, _, value in lines if value.strip().lstrip("-")[:1].isdigit()}

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(PATIENCE_S)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.log.close()
        self.process.stdout.close()
        self.temporary.cleanup()


def centre(pixels):
    """Of the light, in pixels from the upper left corner."""
    floor = sorted(pixels)[len(pixels) // 2] + 200
    weight = x = y = 0
    for i, dn in enumerate(pixels):
        if dn > floor:
            weight, x, y = weight + dn, x + dn * (i % SIZE), y + dn * (i // SIZE)
    return (x / weight, y / weight) if weight else None


def fly_past(steps, quality="hold"):
    """The rock crosses the image; the frames that come of it."""
    with Daemon(quality=quality) as daemon, Simulator("127.0.0.1", daemon.port) as simulator:
        frames, answers = [], []
        for i in range(steps):
            t = 0.5 * i
            for dt in (0.0, 0.1):  # on both sides of the exposure
                simulator.pose("rock", t + dt, (0, 10 * (t + dt), 0), (1, 0, 0, 0))
            answers.append(simulator.step(t))
            frames.append(daemon.frame(answers[-1].number))
        status = daemon.stop()
        return frames, answers, status, daemon.log_text(), json.loads((daemon.folder / "stats.json").read_text())


frames, answers, status, log, statistics = fly_past(12)
check("each step is a frame, in order", [a.number for a in answers] == list(range(1, 13)), answers)
check("and is told its time", answers[3].time == "1.500000000", answers[3])
check("all rows have left", all(a.outcome in ("complete", "late") for a in answers), answers)
check("the daemon ends well", status == 0, log)
check("the clock is the simulator's: locked", "clock: locked (lockstep)" in log, log)
check("the statistics say lockstep", statistics["clock"] == {"state": "lockstep", "source": "lockstep"}, statistics["clock"])
places = [centre(f) for f in frames]
check("there is something to see in each", all(places), places)
if all(places):
    # 5 m a step across at 20 km, 50 mm focal length: 0.69 pixels of 18 um.
    pitch_m = 18e-6
    for axis, name in ((0, "x"), (1, "y")):
        moved = places[-1][axis] - places[0][axis]
        expected = 11 * 5 * 0.05 / 20000 / pitch_m if axis == 0 else 0
        check(f"the rock moves by {expected:.2f} pixels in {name}", abs(abs(moved) - expected) < 0.3, moved)
again, _, _, _, _ = fly_past(12)
check("the same poses and steps give the same bytes", again == frames)
# A second of reserve is more than there is: a camera with deadlines would have to degrade.
adapting, answers, _, _, _ = fly_past(12, "adapt")
check("lockstep never degrades, whatever deadlines may", adapting == frames)
check("and each step says so", all(a.quality["level"] == "full" and a.quality["rows_degraded"] == "0" for a in answers), answers)

with Daemon() as daemon:
    with Simulator("127.0.0.1", daemon.port) as simulator:
        check("it greets", simulator.greeting == "obscura simulator 1", simulator.greeting)
        state = simulator.state()
        check("state", state["acquiring"] == "1" and state["lockstep"] == "1" and state["frames"] == "0" and state["degraded"] == "0", state)
        first = daemon.frame(simulator.step(1).number)
        check("a step back is refused", "not later" in refusal(lambda: simulator.step(0.5)))
        check("and one to the same time", "not later" in refusal(lambda: simulator.step(1)))
        simulator.pose("nobody", 1, (0, 0, 0), (1, 0, 0, 0))
        text = refusal(simulator.state)
        check("an unknown name is refused with those that are known", "camera" in text and "rock" in text, text)
        simulator.answer()  # to the state that was asked for behind it
        simulator.pose_by_udp("rock", 2, (0, 500, 0), (1, 0, 0, 0))
        for i in range(200):  # datagrams take their own way
            pixels = daemon.frame(simulator.step(3 + 0.01 * i).number)
            if centre(pixels) is None:
                break
        check("a pose by UDP takes the rock out of sight", centre(pixels) is None, centre(pixels))

        # Past a pose with rates the thing goes on with them, and the frame tells the age of the pose.
        simulator.pose("rock", 5.5, (0, 7, 0), (1, 0, 0, 0), (0, 100, 0), (0, 0, 0))
        frame = simulator.step(5.55)
        daemon.frame(frame.number)
        cards = daemon.cards(frame.number)
        check("a pose is as old as mid-exposure is later", 0.05 < cards["B0_AGE"] < 0.1, cards["B0_AGE"])
        check("and has gone on with its velocity", abs(cards["B0_Y"] - 7 - 100 * cards["B0_AGE"]) < 1e-6, cards["B0_Y"])
        check("what has no pose from outside has no age", cards["CAM_AGE"] == 0, cards["CAM_AGE"])
        text = refusal(lambda: (simulator.pose("rock", 5.6, (0, 7, 0), (1, 0, 0, 0), (0, 100, 0)), simulator.state()))
        check("half of the rates are refused", "six numbers" in text, text)
        simulator.answer()

        # Several lines at once and half a line: as if they had come one by one.
        simulator.send(b"step 10\nstep 11\nst")
        one, two = simulator.answer(), simulator.answer()
        simulator.send(b"ate\r\n")
        check("lines may come together or in pieces", "10.0" in one and "11.0" in two and simulator.answer().startswith("state"))

        with Simulator("127.0.0.1", daemon.port) as other:
            check("a second client is served", other.state()["acquiring"] == "1")
            check("and may make steps, too", other.step(0.1).outcome in ("complete", "late"))

        random.seed(3)
        words = [b"pose ", b"step ", b"state", b"\n", b"1", b" 0", b" 1e308", b"\0", b"\xff" * 9, b"rock ", b"\n" * 20]
        for i in range(60):
            with socket.create_connection(("127.0.0.1", daemon.port), 10) as raw:
                junk = b"".join(random.choice(words) for _ in range(random.randrange(400)))
                try:
                    raw.sendall(junk if i % 3 else random.randbytes(3000))
                except (BrokenPipeError, ConnectionResetError):
                    pass
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
                udp.sendto(random.randbytes(1 + 20 * i) if i % 2 else junk[:1400], ("127.0.0.1", daemon.port))
        crowd = [socket.create_connection(("127.0.0.1", daemon.port), 10) for _ in range(20)]
        check("the first client is served among hostile ones", simulator.step(1000).outcome in ("complete", "late"))
        for one in crowd:
            one.close()
        with socket.create_connection(("127.0.0.1", daemon.port), 10) as endless:
            endless.settimeout(PATIENCE_S)
            try:
                endless.sendall(b"x" * 100_000)
                while endless.recv(4096):
                    pass
                ended = True
            except (BrokenPipeError, ConnectionResetError):
                ended = True
            check("a line without end ends the connection", ended)
        check("and still", simulator.step(2000).number > 0)
    check("the daemon has lived through it", daemon.process.poll() is None and daemon.stop() == 0, daemon.log_text())
    refused = [line for line in daemon.log_text().splitlines() if "refused" in line]
    check("bad datagrams are one line in the log", len(refused) == 1, refused)

with Daemon(source="timer") as daemon, Simulator("127.0.0.1", daemon.port) as simulator:
    text = refusal(lambda: simulator.step(1))
    check("no steps where a timer drives the camera", "lockstep" in text, text)
    simulator.pose("rock", 0, (0, 500, 0), (1, 0, 0, 0))
    check("but poses", refusal(simulator.state) == "")
    # Eight clients at a time; who comes later is not kept waiting.
    others = [Simulator("127.0.0.1", daemon.port) for _ in range(7)]
    check("eight clients are greeted", all(other.greeting for other in others), [o.greeting for o in others])
    # A peer that goes without a word is noticed: the kernel asks after it (timer 2 of /proc/net/tcp).
    timers, end = [], time.monotonic() + 60
    while timers != ["02"] * 8 and time.monotonic() < end: # 01 while a greeting is not yet acknowledged
        rows = [row.split() for row in pathlib.Path("/proc/net/tcp").read_text(encoding="ascii").splitlines()[1:]]
        timers = [row[5][:2] for row in rows if row[1].endswith(f":{daemon.port:04X}") and row[3] == "01"]
    check("silent connections are asked after", timers == ["02"] * 8, timers)
    try:
        ninth = Simulator("127.0.0.1", daemon.port).greeting
    except OSError:
        ninth = ""
    check("the ninth is not", ninth == "", ninth)
    others.pop().close()
    freed, end = "", time.monotonic() + 60
    while not freed and time.monotonic() < end:
        try:
            freed = Simulator("127.0.0.1", daemon.port).greeting
        except OSError:
            pass
    check("until one of them leaves", freed != "")
    for other in others:
        other.close()
    check("it ends well", daemon.stop() == 0)

# A token is wanted of every client, and proved without being sent.
secret = random.Random(5).randbytes(32)
with Daemon(token=secret) as daemon:
    def open_with(token):
        return Simulator("127.0.0.1", daemon.port, token=token)

    check("a client without the token is told so", "wants a token" in refusal(lambda: open_with(None)))
    check("a wrong one is refused", refusal(lambda: open_with(bytes(32))) == "token: not the one of this camera")
    with socket.create_connection(("127.0.0.1", daemon.port), PATIENCE_S) as raw:
        lines = raw.makefile("rw", encoding="ascii", newline="\n")
        challenges = [lines.readline().split("challenge=")[1]]
        lines.write("step 1\nstep 2\n")
        lines.flush()
        check("before it no line does anything", lines.readline() == "error token: the first line is \"token PROOF\"\n")
        check("and the connection ends", lines.readline() == "")
    with open_with(secret) as simulator:
        challenges.append(simulator.greeting.split("challenge=")[1])
        check("each connection has a challenge of its own", challenges[0].strip() != challenges[1])
        check("with it steps are made", simulator.step(1).number == 1 and simulator.state()["frames"] == "1")
    for _ in range(2):
        refusal(lambda: open_with(bytes(32)))
    before = time.monotonic()
    open_with(secret).close()
    check("after three wrong ones the next has to wait", time.monotonic() - before > 0.9, time.monotonic() - before)
    check("it ends well", daemon.stop() == 0)

# Other machines reach the port with a token only.
with Daemon(host="0.0.0.0") as daemon:
    status = daemon.process.wait(PATIENCE_S)
    check("without a token no other machine reaches the port", status == 78 and "token_file" in daemon.log_text(), (status, daemon.log_text()))
with Daemon(token=secret, host="0.0.0.0") as daemon:
    address = own_address()
    with Simulator(address, daemon.port, token=secret) as simulator:
        here = centre(daemon.frame(simulator.step(1).number))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            udp.settimeout(PATIENCE_S)
            udp.connect((address, daemon.port))
            udp.send(simulator.pose_line("rock", 2, (0, 500, 0), (1, 0, 0, 0)))
            try:
                answer = udp.recv(1)
            except ConnectionRefusedError:
                answer = None
        check("nothing listens for poses by UDP", answer is None, answer)
        there = centre(daemon.frame(simulator.step(3).number))
        check("and none has moved the rock", here and there and math.dist(here, there) < 1, (here, there))
        simulator.pose("rock", 4, (0, 500, 0), (1, 0, 0, 0))
        check("which one with the token does", centre(daemon.frame(simulator.step(4).number)) is None)
    check("it ends well", daemon.stop() == 0)

sys.exit(1 if failures else 0)
