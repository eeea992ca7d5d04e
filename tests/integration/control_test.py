#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A running daemon is called by programs: settings, triggers, poses and steps reach the camera and its frames, a GigE Vision
client keeps them off, and no client disturbs another or the camera.

Usage: control_test.py OBSCURA SOURCE-DIRECTORY OBSCURAD
Exit status 1 if a check failed, 77 without numpy.
"""
import asyncio
import json
import math
import mmap
import os
import pathlib
import random
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import tomllib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402
from client_checks import PATIENCE_S, check, check_refused, end, obscura, obscura_client, source, wait_for  # noqa: E402
import obscura_client.aio  # noqa: E402
from obscura_client import protocol  # noqa: E402
from gvcp_client import CONTROL, CONTROL_PRIVILEGE, NO_CONTROL, GvcpClient  # noqa: E402
from simulator_client import Simulator  # noqa: E402

obscurad = os.path.abspath(sys.argv[3])
WIDTH, HEIGHT = 64, 48


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Daemon:
    """`settings`: tables behind those of every daemon here."""

    def __init__(self, settings, trigger='source = "timer"'):
        self.temporary = tempfile.TemporaryDirectory(prefix="obscura-control-")
        self.folder = pathlib.Path(self.temporary.name)
        self.folder.chmod(0o755)  # for a client of another user
        self.path = str(self.folder / "calls.socket")
        self.tcp = f"127.0.0.1:{free_port(socket.SOCK_STREAM)}"
        (self.folder / "scene.toml").write_text((source / "tests" / "support" / "light_scene.toml").read_text())
        (self.folder / "obscurad.toml").write_text(f"""[scene]
file = "scene.toml"
[daemon]
run = 0
[trigger]
{trigger}
rate_hz = 20
[control]
listen = "{self.tcp}"
unix_socket = "{self.path}"
clients = 24
[monitor]
socket = "{self.folder}/monitor.socket"
[file]
enabled = true
format = "raw"
directory = "frames"
queue_frames = 16
[sensor.readout]
width = {WIDTH}
height = {HEIGHT}
{settings}""")
        self.log = open(self.folder / "log", "w+", encoding="utf-8")
        self.process = Child([obscurad, "--config", self.folder / "obscurad.toml"], stdout=subprocess.PIPE, stderr=self.log)
        self.process.stdout.readline()  # ready

    def camera(self, address=None):
        return obscura_client.connect_camera(address or self.path, timeout_s=PATIENCE_S)

    def ask(self, *arguments):
        answer = subprocess.run([obscura, *arguments, "--json", "--socket", self.folder / "monitor.socket"], capture_output=True,
                                text=True, timeout=PATIENCE_S)
        return [json.loads(line) for line in answer.stdout.splitlines()]

    def file(self, number, ending, run):
        return self.folder / "frames" / f"{'' if run == 1 else f'run{run}_'}frame_{number:06}.{ending}"

    def cards(self, number, run=1):
        """Numbers of the file beside a frame of that acquisition, which is written a little later than the frame leaves."""
        file = self.file(number, "toml", run)
        wait_for(lambda: file.exists() and "EXPOSURE" in file.read_text())
        lines = [line.split("#")[0].partition(" = ") for line in file.read_text().splitlines()]
        return {key: float(value) for key, _, value in lines if value.strip().lstrip("-")[:1].isdigit()}

    def pixels(self, number, run=1, width=WIDTH):
        file = self.file(number, "raw", run)
        wait_for(lambda: file.exists() and file.stat().st_size >= 2 * width * HEIGHT)
        return file.read_bytes()

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


def threading_result(wait, act):
    """What `wait` returns, which another thread waits for while `act` is done."""
    results = []
    waiter = threading.Thread(target=lambda: results.append(wait()))
    waiter.start()
    time.sleep(0.3)
    act()
    waiter.join()
    return results[0]


def settings_and_triggers(daemon):
    daemon.pixels(1)  # so that the next acquisition is the second one for the file sink
    with daemon.camera() as camera, daemon.camera(daemon.tcp) as other:
        check("the daemon's user may do everything, a client of TCP no more than move the scene",
              [camera.server["permission"], other.server["permission"]] == ["admin", "scene"])
        rows = {row["name"]: row for row in camera.features()}
        check("settings have unit, range and value", rows["ExposureTime"]["unit"] == "us" and
              rows["ExposureTime"]["allowed"] == "1 to 3.6e9 us" and rows["ExposureTime"]["value"] == 10000,
              rows["ExposureTime"])
        check("and say whether they can change", rows["Width"]["locked"] and not rows["Gain"]["locked"])
        check("a write answers with all that has changed", camera.set(ExposureTime=2500, Gain=0) == {"ExposureTime": 2500})
        check("the typed calls tell the same", camera.calls.camera_get(names=["ExposureTime"])["values"] == {"ExposureTime": 2500})
        check("another client sees it", other.get("ExposureTime") == 2500 and other.get("Gain", "Width") == {"Gain": 0, "Width": WIDTH})
        check_refused("a value out of range is refused as in a file", "bad-argument",
                      "camera.set: ExposureTime: 0 is out of range, allowed 1 to 3.6e9 us", lambda: camera.set(ExposureTime=0, Gain=3))
        check("and nothing of that request holds", camera.get("Gain") == 0)
        check_refused("an unknown name is refused with a suggestion", "bad-argument", 'did you mean "Gain"?', lambda: camera.set(Gian=1))
        check_refused("a window beyond the sensor is refused", "bad-argument", "OffsetX", lambda: camera.set(OffsetX=8))
        check_refused("the image keeps its size during acquisition", "not-now", "Width", lambda: camera.set(Width=32))
        check_refused("the timer's camera takes no trigger", "not-now", "TriggerSource Line0, not On and Software", camera.trigger)
        check_refused("there is one camera", "bad-argument", "there is no camera 1", lambda: daemon.camera().call("camera.get", camera=1))

        check("acquisition stops", camera.stop() and not camera.stop())
        check_refused("no trigger without acquisition", "not-now", "does not acquire", camera.trigger)
        camera.set(Width=32, TriggerSource="Software", TestPattern="White")
        check("and starts", camera.start() and not camera.start())
        wait_for(lambda: other.state()["cameras"][0]["trigger_ready"])
        first = camera.trigger()
        check("a trigger tells of its frame", first["accepted"] and first["frame"] == 1 and
              first["outcome"] in ("complete", "late"), first)
        cards = daemon.cards(1, run=2)
        check("the frame has the settings", cards["EXPOSURE"] == 0.0025 and cards["width"] == 32, cards)
        white = struct.unpack("<H", daemon.pixels(1, 2, 32)[:2])[0]
        check("and the test pattern", white == 4095, white)
        before = other.state()["cameras"][0]["camera"]["complete"]
        wait_for(lambda: other.state()["cameras"][0]["trigger_ready"])
        second = other.trigger()
        check("any client may trigger", second["frame"] == 2 and second["edge_tai_ns"] > first["edge_tai_ns"], second)
        wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"])
        check("without waiting the answer comes at once", "outcome" not in camera.trigger(wait=False))
        wait_for(lambda: camera.state()["cameras"][0]["camera"]["complete"] == before + 2)

        last = camera.frame()
        check("the last frame is there for one who looks after it", last.frame == 3, last.info)
        frame = threading_result(lambda: camera.frame(last.number), lambda: other.trigger())
        check("a frame is that of the file, to the byte", frame.pixels.shape == (HEIGHT, 32) and frame.info["rows"] == HEIGHT and
              frame.pixels.astype("<u2").tobytes() == daemon.pixels(frame.frame, 2, 32)[:2 * 32 * HEIGHT], frame.info)
        check("it has the settings", frame.info["exposure_us"] == 2500 and frame.bits == 12, frame.info)
        check("the same one again", other.frame(wait_s=0).number == frame.number)
        check_refused("no newer one without a trigger", "not-now", "none came in 0.1 s", lambda: other.frame(frame.number, 0.1))
        wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"])
        next_one = threading_result(lambda: camera.frame(frame.number), lambda: other.trigger())
        check("the next frame skips none", next_one.frame == frame.frame + 1 and next_one.skipped == 0, next_one)

        told, monitor = camera.state(), daemon.ask("status")[0]
        for one in (told, monitor):  # what goes on
            for key in ("up_s", "resident_mib", "locked_mib", "log_lines"):
                del one["daemon"][key]
            one.pop("threads")
            one.pop("heartbeats")
            one["cameras"][0].pop("recent")
            one["cameras"][0].pop("pool")
            one["cameras"][0].pop("verdict")
            one["cameras"][0]["camera"].pop("ignored")
        check("the state is the same at the monitor's socket", told == monitor, (told, monitor))
        threads = [t for t in camera.state()["threads"] if t["name"] == "calls"]
        check("calls run on ordinary threads of low priority", len(threads) >= 3 and
              all(t["policy"] == "other" and t["nice"] == 5 for t in threads), threads)
        check("and so are the events", camera.events()[:5] == daemon.ask("events")[:5])
        check("later events only", camera.events(after=2)[0]["id"] == 3)
        check("the state tells where calls are taken", monitor["daemon"]["control"] == daemon.path)
        time_stamps(camera)
        configuration_in_use(daemon, camera)
        check_refused("a camera without GigE Vision has no faults", "not-now", "no transport", camera.faults)
        names = [call["name"] for call in camera.describe()["calls"]]
        check("the calls describe themselves", {"camera.set", "state", "pose"} <= set(names), names)
        if os.geteuid() == 0:
            member = subprocess.run([sys.executable, "-c", f"""import os, sys
os.setgroups([]); os.setresgid(0, 0, 0); os.setresuid(65534, 65534, 65534)
sys.path.insert(0, {str(source / 'clients' / 'python')!r})
import obscura_client
print(obscura_client.connect_camera({daemon.path!r}).server["permission"])"""], capture_output=True, text=True)
            check("a member of the group may move the scene", member.stdout == "scene\n", member)


def frame_ring(daemon):
    """Memory of the newest frames, handed over by a call."""
    with daemon.camera() as camera:
        told = camera.call("ring", pid=daemon.process.pid)
        memory, news = camera.take_descriptors()
        check("the ring is of that process", told["pid"] == daemon.process.pid and told["camera"] == 0 and told["watched_s"] == 2, told)
        camera.call("watch", period_us=0)
        check("a frame is signalled", bool(select.select([news], [], [], PATIENCE_S)[0]) and len(os.read(news, 8)) == 8)
        with mmap.mmap(memory, 0, mmap.MAP_SHARED, mmap.PROT_READ) as ring:
            check("and stands in the memory", ring[:8] == b"OBSCRING")
        for one in (memory, news):
            os.close(one)
        check_refused("another process is none of this daemon", "bad-argument", f"pid: this is process {daemon.process.pid}",
                      lambda: camera.call("watch", pid=1))
        before = len(os.listdir("/proc/self/fd"))
        for _ in range(3):
            camera.call("ring")
        camera.call("status")
        check("files that nobody takes are closed", len(os.listdir("/proc/self/fd")) == before)
    with daemon.camera(daemon.tcp) as other:
        check_refused("no files are handed over by TCP", "forbidden", "ring: files are handed over at a Unix socket only",
                      lambda: other.call("ring"))


def streams(daemon):
    """Frames that the daemon sends by itself. How many it skips is a matter of the machine's load."""
    def follow(frames, count):
        taken = []
        for frame in frames:
            taken.append(frame)
            if len(taken) == count:
                return taken
        return taken

    def tell_skipped(taken):
        return all(b.number - a.number == 1 + b.skipped for a, b in zip(taken, taken[1:]))

    with daemon.camera() as camera, daemon.camera() as other:
        taken = []
        for frame in camera.frames(ahead=2):
            taken.append(frame)
            if len(taken) == 2:
                check("other calls go on within a stream", camera.get("Gain") == 0 and camera.status()["streams"] == 1)
            if len(taken) == 6:
                break
        check("frames of a stream come in their order, and tell what was skipped", tell_skipped(taken), [f.info for f in taken])
        check("they are those of the files, to the byte", all(
            frame.pixels.astype("<u2").tobytes() == daemon.pixels(frame.frame)[:2 * WIDTH * HEIGHT] for frame in taken))
        check("a stream that was left ends", wait_for(lambda: camera.status()["streams"] == 0))
        check("and leaves its connection as it was", camera.frame(taken[-1].number).number > taken[-1].number)
        taken = follow(camera.frames(every=4, codec="none"), 4)
        check("every fourth frame", tell_skipped(taken) and all(f.skipped >= 3 for f in taken[1:]), [f.info for f in taken])
        late = camera.frames()
        first = next(late)
        wait_for(lambda: other.frame().number > first.number + 8)
        second = next(late)
        check("a slow reader gets the newest frame next", second.number > first.number + 7 and tell_skipped([first, second]), second.info)
        late.close()
        heads = [head["number"] for head, _ in camera._connection.stream("stream", {"frames": 3}, ahead=5)]
        check("a stream ends after the frames that were asked for", len(heads) == 3, heads)
        two = [camera.frames(), camera.frames(every=2)]
        check("two streams of one connection", all(next(stream).number > 0 for stream in two * 2))
        check_refused("a stream that cannot be is refused", "bad-argument", "every", lambda: next(camera.frames(every=0)))

        async def tasks():
            async with await obscura_client.aio.connect_camera(daemon.path, timeout_s=PATIENCE_S) as both:
                async def read(every, count):
                    numbers = []
                    async for one in both.frames(every=every, ahead=1):
                        numbers.append(one.number)
                        if len(numbers) == count:
                            return numbers
                    return numbers
                read_by = await asyncio.gather(read(1, 5), read(2, 3), both.get("Gain"))
                late_ones = [stream async for stream in both._stream("stream", {"frames": 2}, 0)]
                return read_by, len(late_ones), (await both.status())["waiting"]
        (ones, twos, gain), ended, waiting = asyncio.run(tasks())
        check("tasks read streams side by side", sorted(set(ones)) == ones and all(b - a >= 2 for a, b in zip(twos, twos[1:])) and
              gain == 0 and ended == 2 and waiting == 0, (ones, twos))

        with socket.socket(socket.AF_UNIX) as lazy:
            lazy.connect(daemon.path)
            for number, call, fields in ((1, "hello", {}), (2, "stream", {"credits": 1000})):
                lazy.sendall(protocol.request(number, call, fields))
            newest = other.frame().number
            check("a client that does not read holds up nobody", len(follow(other.frames(), 5)) == 5 and
                  other.frame().number >= newest + 4)


def configuration_in_use(daemon, camera):
    """Each key as `--print-config` prints it, and the file and line that it comes from."""
    printed = subprocess.run([obscurad, "--config", daemon.folder / "obscurad.toml", "--print-config"], capture_output=True, text=True,
                             check=True).stdout
    wanted = {}

    def flatten(table, path):
        for name, value in table.items():
            if isinstance(value, dict):
                flatten(value, f"{path}{name}.")
            else:
                wanted[path + name] = value

    flatten(tomllib.loads(printed), "")
    told = camera.configuration()
    check("the configuration is that which is printed", wanted == {e["key"]: tomllib.loads(f"x = {e['value']}")["x"] for e in told["entries"]})
    of = {e["key"]: e for e in told["entries"]}
    line = 1 + (daemon.folder / "obscurad.toml").read_text().splitlines().index("rate_hz = 20")
    check("with the lines that it comes from", of["trigger.rate_hz"]["source"] == f"{daemon.folder}/obscurad.toml:{line}" and
          of["trigger.rate_hz"]["unit"] == "Hz" and of["gige.port"]["source"] == "default", of["trigger.rate_hz"])


def time_stamps(camera):
    """Rows of the frames that were triggered before."""
    wait_for(lambda: camera.timing()["rows"][-1][0] == 5)
    stamps = camera.timing()
    rows = [dict(zip(stamps["columns"], row)) for row in stamps["rows"]]
    check("each frame has a row", stamps["columns"][0] == "frame_id" and [row["frame_id"] for row in rows[-5:]] == [1, 2, 3, 4, 5], stamps)
    check("with its stamps in order", all(row["edge_ns"] <= row["seen_ns"] <= row["render_begin_ns"] <= row["render_end_ns"] <=
                                          row["detector_end_ns"] and row["first_ns"] <= row["last_ns"] and row["rows"] == HEIGHT and
                                          row["edge_ns"] <= row["file_first_byte_ns"] for row in rows), rows)
    check("what was told is not told again", camera.timing(after=stamps["last"])["rows"] == [])
    newest = camera.timing(after=stamps["last"] - 3, most=2)
    check("only the newest rows, if there are more", newest["rows"] == stamps["rows"][-2:] and newest["last"] == stamps["last"], newest)
    for row in rows[-5:]:
        told = camera.timing_rows(row["frame_id"])
        latest = max(us for us in told["lateness_us"] if us is not None)
        check("rows of a frame are late as its row says", told["frame"] == row["frame_id"] and told["acquisition"] == row["acquisition"] and
              len(told["lateness_us"]) == HEIGHT and latest == row["worst_row_ns"] // 1000 and told["lateness_us"][row["worst_row"]] == latest, (told, row))
    check("those of the newest frame without a number", camera.timing_rows()["frame"] == 5)
    check_refused("a frame that never was", "not-now", "timing.rows: frame 77 is not one of the latest that have ended", lambda: camera.timing_rows(77))
    stages = camera.state()["cameras"][0]["stages_us"]
    check("stages count the same frames", {stages[name]["count"] for name in ("trigger_seen", "render", "detector")} ==
          {stages["first_byte"]["file"]["count"]} == {stamps["last"]}, stages)


def another_scene():
    """Frames of one scene, then of another, without a frame between them that is late by the building of it."""
    with Daemon("[gige]\nenabled = false\n[deadline]\npolicy = \"late\"\n") as daemon, daemon.camera() as camera, daemon.camera() as other:
        streams(daemon)
        frame_ring(daemon)
        text = (daemon.folder / "scene.toml").read_text()
        (daemon.folder / "sub").mkdir()
        (daemon.folder / "sub" / "dark.toml").write_text(text.replace("albedo = 0.1", "albedo = 0"))
        (daemon.folder / "wrong.toml").write_text(text.replace("albedo = 0.1", "albedo = 7"))
        (daemon.folder / "bands.toml").write_text("[[band]]\nfrom_nm = 500\nto_nm = 600\n" + text)
        listed = camera.call("scene.list")
        check("scenes are listed, files of other kinds are not", listed["shown"] == "scene.toml" and "demo" in listed["scenes"] and
              listed["scenes"][-4:] == ["bands.toml", "scene.toml", "sub/dark.toml", "wrong.toml"], listed)
        check("those that cannot be shown are listed with the reason", "spectral bands" in listed["why_not"]["bands.toml"] and
              "albedo" in listed["why_not"]["wrong.toml"] and not {"scene.toml", "sub/dark.toml"} & set(listed["why_not"]), listed["why_not"])
        before = camera.frame()
        check("the first scene has light", before.pixels.max() > 200, before.pixels.max())
        for what, file, code, message in (
                ("a scene with a mistake", "wrong.toml", "bad-scene", "albedo"),
                ("a scene of other spectral bands", "bands.toml", "bad-scene", "spectral bands"),
                ("a file elsewhere", "/etc/hostname", "bad-argument", "below control.scenes"),
                ("a file above", "sub/../../x.toml", "bad-argument", "below control.scenes"),
                ("a file that is not there", "nothing.toml", "bad-argument", "no such file")):
            check_refused(f"{what} is refused", code, message, lambda f=file: camera.show_scene(f))
        after = camera.frame(before.number)
        check("and the old one goes on", abs(int(after.pixels.max()) - int(before.pixels.max())) < 100, after.pixels.max())
        camera.show_scene("sub/dark.toml")
        shown = camera.frame(camera.frame().number + 2)  # that of the next frame may be rendered already
        check("and it is listed as the one that is shown", other.call("scene.list")["shown"] == "sub/dark.toml")
        check("another scene is shown", shown.pixels.max() < 200, shown.pixels.max())
        counted = other.state()["scenes"]
        check("scenes are counted", counted == {"shown": 1, "refused": 2}, counted)
        said = [e["text"] for e in camera.events() if e["text"].startswith("scene: ")]
        check("and told in the log", len(said) == 3 and said[2].endswith("sub/dark.toml is shown"), said)
        (daemon.folder / "many.toml").write_text(text.replace("albedo = 0.1", "albedo = 0") + "".join(
            f'[[body]]\nshape = "ellipsoid"\nradii_m = [5, 4, 3]\nalbedo = 0\nposition_m = [{i}, 0, 0]\n' for i in range(5)))
        threading_result(lambda: camera.show_scene("many.toml"), lambda: [other.state() for _ in range(5)])
        check("calls are answered beside, and a scene of more bodies is shown", other.state()["scenes"]["shown"] == 2)
        counters = other.state()["cameras"][0]["camera"]
        check("no frame is lost", counters["abandoned"] == counters["dropped"] == 0, counters)
        daemon.process.send_signal(signal.SIGHUP)
        wait_for(lambda: any("taken on" in e["text"] for e in other.events()))
        last = other.frame(other.frame().number + 2)
        check("a reload returns to the scene of the configuration", last.pixels.max() > 200, last.pixels.max())
        check("the daemon ends well", daemon.stop() == 0)


def hostile_clients(daemon):
    dice = random.Random(11)
    with daemon.camera() as camera:
        before = camera.state()["cameras"][0]["camera"]["complete"]
        for i in range(40):
            with socket.create_connection(daemon.tcp.split(":"), PATIENCE_S) as raw:
                junk = dice.choice([b"OBSC\x01\x01\0\0", b""]) + dice.randbytes(dice.randrange(2000))
                try:
                    raw.sendall(junk)
                except ConnectionError:
                    pass
        crowd, refusals = [], 0
        while len(crowd) < 30 and refusals < 40:  # until those that have gone are found to be
            try:
                crowd.append(daemon.camera())
                refusals = 0
            except (obscura_client.RequestError, obscura_client.ConnectionLost):
                refusals += 1
                time.sleep(0.05)
        check("clients beyond the limit, and two of the machine itself, are refused", len(crowd) == 25, len(crowd))
        answers = []
        askers = [threading.Thread(target=lambda c=c: [answers.append(c.state()) for _ in range(3)]) for c in crowd]
        for asker in askers:
            asker.start()
        for asker in askers:
            asker.join()
        check("all that are served are answered", len(answers) == 3 * len(crowd), len(answers))
        for one in crowd:
            one.close()
        camera.set(TriggerSource="Line0")
        check("frames go on", wait_for(lambda: camera.state()["cameras"][0]["camera"]["complete"] > before + 3))
        camera.set(TriggerSource="Software")
        waiting = []
        with daemon.camera() as second:
            asker = threading.Thread(target=lambda: waiting.append(daemon.process.send_signal(signal.SIGTERM)))
            asker.start()
            try:
                while True:
                    second.state()
            except (obscura_client.RequestError, obscura_client.ConnectionLost):
                pass
            asker.join()
    check("the daemon ends while clients ask", daemon.process.wait(PATIENCE_S) == 0)
    check("and takes its socket along", not os.path.exists(daemon.path))


def poses_and_steps():
    """Poses and steps by calls make the bytes that those by the simulator port make."""
    def fly(move):
        port = free_port(socket.SOCK_STREAM)
        with Daemon(f"""[gige]
enabled = false
[simulator]
enabled = true
listen = "127.0.0.1:{port}"
""", 'source = "lockstep"') as daemon, daemon.camera() as camera, Simulator("127.0.0.1", port) as simulator:
            numbers = [move(camera, simulator, t) for t in (0.5, 1.0, 1.5)]
            if move is by_calls:
                check_refused("a step back is refused", "not-now", "not later", lambda: camera.step(1))
                check_refused("an unknown name is refused with those that are known", "bad-argument", "allowed body0, camera",
                              lambda: camera.pose("nobody", 9, (0, 0, 0)))
                check_refused("a name is one word", "bad-argument", "without blanks", lambda: camera.pose("camera 1\nstep", 9, (0, 0, 0)))
                check_refused("a pose of the past is refused", "bad-argument", "not later", lambda: camera.pose("camera", 1, (0, 0, 0)))
                check("the port tells of no more than its own refusals", simulator.state()["frames"] == "3")
            return [daemon.pixels(n) for n in numbers]

    turned = (0.9998477, 0, 0.0174524, 0)  # 2 degrees

    def by_calls(camera, _, t):
        camera.pose("camera", t, (1e3 * t, 20, 3), turned)
        camera.pose("camera", t + 0.1, (1e3 * t, 20, 4), turned, velocity_m_s=(0, 0, 10))
        frame = camera.step(t)
        check("a step tells of its frame", frame["outcome"] in ("complete", "late") and frame["level"] == "full", frame)
        return frame["frame"]

    def by_port(_, simulator, t):
        simulator.pose("camera", t, (1e3 * t, 20, 3), turned)
        simulator.pose("camera", t + 0.1, (1e3 * t, 20, 4), turned, (0, 0, 10), (0, 0, 0))
        return simulator.step(t).number

    check("poses and steps are those of the simulator port, to the byte", fly(by_calls) == fly(by_port))


def bodies_of_frames():
    """Where `truth` sees bodies is where a pinhole at the pose of the frame has them."""
    port = free_port(socket.SOCK_STREAM)
    with Daemon(f"""[gige]
enabled = false
[simulator]
enabled = true
listen = "127.0.0.1:{port}"
[sensor]
pixel_pitch_um = 8
""", 'source = "lockstep"') as daemon, daemon.camera() as camera:
        check_refused("no frame has been looked at", "not-now", "no frame came", lambda: camera.call("truth", wait_s=0))
        place, (w, x, y, z) = (-20000, 31, -17), (0.5004, -0.4997, 0.5001, -0.4998)
        camera.pose("camera", 0.5, place, (w, x, y, z))
        frame = camera.step(0.5)
        told = camera.call("truth")
        n = w * w + x * x + y * y + z * z
        # Columns of the matrix from camera to inertial axes: right, down, ahead.
        axes = ((w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)),
                (2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)),
                (2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z))
        right, down, ahead = (sum(-p * a for p, a in zip(place, axis)) / n for axis in axes)
        f = 50e3 / 8
        wanted = ((WIDTH - 1) / 2 + f * right / ahead, (HEIGHT - 1) / 2 + f * down / ahead)
        body = told["bodies"][0]
        check("truth is of the newest frame", told["frame"] == frame["frame"] and len(told["bodies"]) == 1, (told, frame))
        check("a body is where the pinhole has it", math.dist(wanted, (body["x"], body["y"])) < 0.001, (wanted, body))
        check("the bounding sphere has its radius", abs(body["radius_px"] - f * 500 / math.hypot(*place)) < 0.01 * body["radius_px"], body)
        check("its range is that to the origin", abs(body["range_m"] - math.hypot(*place)) < 1e-6, body)
        centre = [round(body[axis]) for axis in "xy"]
        pixel = camera.probe(*centre, frame["frame"])
        check("a pixel there shows it", pixel["body"] == body["name"] and abs(pixel["range_m"] - math.hypot(*place) + 500) < 10, pixel)
        camera.pose("camera", 0.6, (0, 0, 20000), (1, 0, 0, 0))
        later = camera.probe(*centre, frame["frame"])
        check("wherever the camera goes after that frame", later["body"] == body["name"] and abs(later["range_m"] - pixel["range_m"]) < 10 and
              later["dn"] == pixel["dn"], (pixel, later))


# Registers of docs/reference/features.md: AcquisitionStart and -Stop, FaultPercent by FaultSelector.
ACQUISITION_START, ACQUISITION_STOP = 0xA104, 0xA108
LOSE, SKIP_FRAME = 0xA500, 0xA500 + 4 * 8


def faults_beside(client, camera):
    """One list of rules for calls and features; strikes are counted exactly."""
    check("no faults at first", camera.faults() == [])
    check("a rule of calls is a feature", camera.set_faults({"kind": "lose", "percent": 12.5})[0]["origin"] == "call" and
          client.read(LOSE) == 12500)
    check("and a feature is a rule", client.write(SKIP_FRAME, 50000) == 0 and
          [(r["kind"], r["percent"], r["origin"]) for r in camera.faults()] == [("lose", 12.5, "call"), ("skip_frame", 50, "feature")])
    for what, rules, message in (
            ("an unknown kind", [{"kind": "lost"}], 'rules[0].kind: "lost"'),
            ("a share out of range", [{"kind": "lose"}, {"kind": "lose", "percent": 101}], "rules[1].percent: 101 is out of range, allowed 0 to 100 %"),
            ("a window that ends before it begins", [{"kind": "lose", "first": 9, "last": 3}], "rules[0].last: 3 is before the first, 9"),
            ("an unknown key", [{"kind": "lose", "percents": 1}], 'rules[0].percents: unknown key, did you mean "percent"?'),
            ("a rule without a kind", [{"percent": 1}], "kind"),
            ("65 rules", [{"kind": "lose"}] * 65, "at most 64")):
        check_refused(f"{what} is refused", "bad-argument", message, lambda r=rules: camera.set_faults(*r))
    check_refused("what is no rule is refused", "bad-argument", "rules[0]", lambda: camera.call("faults.set", rules=[3]))
    check("and nothing changes", len(camera.faults()) == 2)
    camera.set_faults({"kind": "skip_frame", "first": 2, "last": 6}, {"kind": "repeat_frame", "first": 8, "last": 10})
    # A repeated frame has a number of its own: 9 is frame 8 once more.
    check("features cannot say a window", client.read(SKIP_FRAME) == 0 and client.read(LOSE) == 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sink:
        sink.bind(("127.0.0.1", 0))
        for address, value in (0xD18, 0x7F000001), (0xD00, sink.getsockname()[1]), (ACQUISITION_START, 1):
            check("the stream is opened", client.write(address, value) == 0)
        sent = lambda: camera.state()["cameras"][0]["transports"]["gige"]
        wait_for(lambda: sent()["delivered"] >= 12)
        check("each rule has struck as often as it says", [r["struck"] for r in camera.faults()] == [5, 2], camera.faults())
        check("and withheld as many frames", sent()["injected_losses"] == 5, sent())
        kept = camera.set_faults({"kind": "drop_leader"}, *camera.faults()[:1])
        check("a rule that stays keeps its strikes", [r["struck"] for r in kept] == [0, 5], kept)
        wait_for(lambda: camera.faults()[0]["struck"] > 2)
        check("without rules nothing is struck any more", camera.set_faults() == [])
        check("the acquisition ends", client.write(ACQUISITION_STOP, 1) == 0)


def beside_gige():
    port = free_port(socket.SOCK_DGRAM)
    with Daemon(f"""[gige]
enabled = true
interface = "127.0.0.1"
port = {port}
""") as daemon, daemon.camera() as camera:
        check("without a client of its own the camera is open to calls", camera.set(Gain=3) == {"Gain": 3})
        client = GvcpClient(port, PATIENCE_S)
        check("a GigE Vision client takes control", client.write(CONTROL_PRIVILEGE, CONTROL) == 0)
        for what, call in (("write", lambda: camera.set(Gain=6)), ("start", camera.start), ("stop", camera.stop), ("trigger", camera.trigger)):
            check_refused(f"then no {what} of others", "controlled", f"controlled by {client.address()}", call)
        check("but they may look", camera.get("Gain") == 3 and camera.state()["cameras"][0]["controller"] == client.address())
        faults_beside(client, camera)
        check("who may do everything may force a write", camera.set(force=True, Gain=6) == {"Gain": 6} and camera.get("Gain") == 6)
        said = [e["text"] for e in camera.events() if " set although " in e["text"]]
        check("and the log tells it, with the controller's address", len(said) == 1 and "Gain" in said[0] and client.address() in said[0], said)
        with daemon.camera(daemon.tcp) as stranger:
            check_refused("others may not", "forbidden", "admin", lambda: stranger.set(force=True, Gain=9))
        check("it leaves", client.write(CONTROL_PRIVILEGE, NO_CONTROL) == 0)
        check("and the camera is open again", camera.set(TriggerSource="Software")["TriggerSource"] == "Software")
        check("to triggers, too", camera.start() and camera.trigger()["frame"] == 1)
        check_refused("no poses without a simulator port", "not-now", "simulator.enabled", lambda: camera.pose("camera", 1, (0, 0, 0)))
        check("the daemon ends well", daemon.stop() == 0)


with Daemon("[gige]\nenabled = false\n") as alone:
    settings_and_triggers(alone)
    hostile_clients(alone)
another_scene()
poses_and_steps()
bodies_of_frames()
beside_gige()
sys.exit(end())
