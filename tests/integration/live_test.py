#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Live pictures of obscura-web: digital numbers and histograms are those of the frame's file, no viewer gets more than it is ready for, and
clients that follow no rule are survived.

Usage: live_test.py OBSCURAD OBSCURA-WEB SOURCE-DIRECTORY [MUTATED-MESSAGES (3000)]
Exit status 1 if a check failed.
"""
import atexit
import base64
import http.client
import json
import os
import pathlib
import random
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402
from read_image import read_png  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402
from websocket_client import BINARY, PING, TEXT, Closed, Refused, Viewer, WebSocket, frame  # noqa: E402

obscurad, web, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
MUTATED = int(sys.argv[4]) if len(sys.argv) > 4 else 3000
PATIENCE_S = 60  # a busy machine, a sanitizer
WIDTH, HEIGHT = 64, 48
failures = []
processes = []
atexit.register(lambda: [process.kill() for process in processes])


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def wait_for(condition):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.1)
    return False


def start(camera):
    processes.append(camera.start())
    return processes[-1]


def outcome(action):
    """What ended it: the status of a refused handshake or the code of a close frame."""
    try:
        return action()
    except Refused as refused:
        return refused.status
    except Closed as closed:
        return closed.code
    except ConnectionResetError:
        return None


class Web:
    def __init__(self, *arguments):
        self.process = Child([web, "--listen", "127.0.0.1:0", *arguments], stdout=subprocess.PIPE, text=True)
        processes.append(self.process)
        link = self.process.stdout.readline().strip()
        self.port, self.token = int(link.split("//")[1].split("/")[0].split(":")[1]), link.partition("token=")[2]

    def ask(self, path, raw=False, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        connection.request("GET", path, headers={"Authorization": f"Bearer {self.token}", **{k.replace("_", "-"): v for k, v in headers.items()}})
        answer = connection.getresponse()
        answer.text = answer.read()
        if not raw:
            answer.text = answer.text.decode()
        connection.close()
        return answer

    def state(self):
        return json.loads(self.ask("/api/v1/state").text)

    def metric(self, name):
        return float(re.search(rf"^{re.escape(name)} (\S+)$", self.ask("/metrics").text, re.M).group(1))

    def viewer(self, **options):
        return Viewer(self.port, self.token, **options)

    def resident_mib(self):
        return int(pathlib.Path(f"/proc/{self.process.pid}/status").read_text().split("VmRSS:")[1].split()[0]) / 1024

    def end(self):
        self.process.terminate()
        return self.process.wait(PATIENCE_S)


def size_of_jpeg(data):
    """Width and height of a baseline JPEG."""
    at = 2
    while data[at + 1] != 0xC0:
        at += 2 + struct.unpack_from(">H", data, at + 2)[0]
    return struct.unpack_from(">HH", data, at + 5)[::-1]


def file_of(folder, header):
    """Pixels of the frame's file, once it is whole."""
    size = 2 * WIDTH * HEIGHT
    found = []

    def whole():
        found[:] = [f for f in folder.rglob(f"frame_{header['frame']:06}.raw") if f.stat().st_size >= size]
        return found

    wait_for(whole)
    # A run that begins again has the same names in a folder of its own.
    return struct.unpack(f"<{WIDTH * HEIGHT}H", max(found, key=lambda f: f.stat().st_mtime).read_bytes()[-size:])


def reduced(pixels, h):
    """The view of a header, bin by bin."""
    out = []
    for by in range(h["y"], h["y"] + h["h"], h["bin"]):
        for bx in range(h["x"], h["x"] + h["w"], h["bin"]):
            values = [pixels[y * WIDTH + x] for y in range(by, min(by + h["bin"], h["y"] + h["h"]))
                      for x in range(bx, min(bx + h["bin"], h["x"] + h["w"]))]
            out.append((2 * sum(values) + len(values)) // (2 * len(values)) if h["reduce"] else max(values))
    return tuple(out)


def histogram(pixels, bits):
    ordered = sorted(pixels)
    bins = [0] * 256
    for dn in pixels:
        bins[dn >> (bits - 8)] += 1
    at = lambda percent: ordered[-(-percent * len(ordered) // 100) - 1]  # noqa: E731
    return {"bins": bins, "saturated": pixels.count((1 << bits) - 1), "min": ordered[0], "max": ordered[-1], "p50": at(50), "p99": at(99)}


def bytes_of(server, ident, name, **headers):
    answer = server.ask(f"/api/v1/cameras/{ident}/frames/{name}", raw=True, **headers)
    return answer.status, answer.text, answer.headers


def kept_frames(server, viewer, ident, header):
    """Files of the frame that a viewer has got, by its id, also long after."""
    pixels = struct.pack(f"<{WIDTH * HEIGHT}H", *file_of(folder, header))
    time.sleep(1)  # ten frames
    status, raw, headers = bytes_of(server, ident, f"{header['id']}.raw")
    check("the frame on a screen can be had by its id, and is that frame", status == 200 and raw == pixels and
          headers["X-Obscura-Id"] == str(header["id"]) and headers["X-Obscura-Frame"] == str(header["frame"]), (status, headers))
    status, png, headers = bytes_of(server, ident, f"{header['id']}.png")
    check("as PNG", struct.pack(f"<{WIDTH * HEIGHT}H", *read_png(png)[0]) == pixels)
    check("what is known already is not sent again", bytes_of(server, ident, f"{header['id']}.png", If_None_Match=headers["ETag"])[:2] == (304, b""))
    known = json.loads(bytes_of(server, ident, f"{header['id']}.json")[1])
    check("what is known of it is in its header", known["edge_tai_ns"] == str(header["edge_tai_ns"]) and known["trigger"] == str(header["trigger"]) and
          (known["width"], known["height"], known["rows"], known["bits"]) == (WIDTH, HEIGHT, header["rows"], header["bits"]), known)
    for name in f"{header['id'] + 100000}.raw", "0.png", f"{2**64 - 1}.fits":
        status, text, _ = bytes_of(server, ident, name)
        check(f"{name} is gone", status == 404 and json.loads(text)["type"] == "urn:obscura:gone", text)
    for name in f"{2**64}.raw", "-1.raw", "1.5.raw", "1x.raw", ".raw", "1/.raw":
        status, text, _ = bytes_of(server, ident, name)
        check(f"{name} is no path", status == 404 and json.loads(text)["type"] == "urn:obscura:no-such-path", text)
    check("of another camera it is none", bytes_of(server, "1-0", f"{header['id']}.raw")[0] == 404)
    viewer.texts.clear()


def slow_viewer(server, ident):
    """A slow viewer gets the newest frame each time: none is older than what another one had seen when it asked."""
    slow, fast = server.viewer(), server.viewer()
    seen, stop = [0], threading.Event()

    def watch():
        fast.view(ident, max_hz=60)
        while not stop.is_set():
            seen[0] = fast.picture()[0]["id"]
            fast.ready()

    thread = threading.Thread(target=watch)
    thread.start()
    slow.view(ident, max_hz=60)
    slow.picture()
    wrong = []
    for _ in range(8):
        time.sleep(0.35)  # of a long way, or of drawing
        before = seen[0]
        slow.ready()
        header = slow.picture()[0]
        if not before or header["id"] < before:
            wrong.append((header["id"], before))
    stop.set()
    thread.join()
    slow.close()
    fast.close()
    check("a slow viewer's picture is no older than its own way", wrong == [], wrong)


def copied(server):
    return server.state()["daemons"][0]["cameras"][0]["transports"]["watch"]["submitted"]


with tempfile.TemporaryDirectory(prefix="obscura-live-") as temporary:
    folder = pathlib.Path(temporary)
    camera = SmallDaemon(folder, obscurad, source)
    server = Web("--socket", camera.socket)
    daemon = start(camera)
    check("the daemon is found", wait_for(lambda: server.state()["daemons"]))
    ident = f"{daemon.pid}-0"

    # Pictures are the frames.
    viewer = server.viewer()
    viewer.view(ident)
    header, pixels = viewer.picture()
    check("the first picture, of the whole image, comes without being asked for", (header["w"], header["h"], header["bin"]) == (WIDTH, HEIGHT, 1), header)
    check("its header has the frame's size, bits and rows", (header["width"], header["height"], header["rows"], header["camera"]) ==
          (WIDTH, HEIGHT, HEIGHT, 0) and 8 <= header["bits"] <= 16 and header["frame"] > 0 and header["skipped"] == 0 and header["flags"] == 0 and
          abs(header["edge_tai_ns"] / 1e9 - time.clock_gettime(time.CLOCK_REALTIME)) < 3600, header)
    check("its digital numbers are those of the file", pixels == file_of(folder, header))
    told = viewer.text("histogram")
    expected = histogram(pixels, header["bits"])
    check("the histogram is that of the file", told["frame"] == str(header["frame"]) and {k: told[k] for k in expected} == expected and
          abs(told["mean"] - sum(pixels) / len(pixels)) < 1e-9, told)
    while header["made_tai_ns"] == 0:  # until the daemon has told its clock
        viewer.ready()
        header = viewer.picture()[0]
    check("it was made after the frame's edge, and the header says when", 0 < header["made_tai_ns"] - header["edge_tai_ns"] < PATIENCE_S * 1e9, header)
    kept_frames(server, viewer, ident, header)
    last = header["frame"]
    for fields in ({"x": 10, "y": 7, "w": 21, "h": 17, "bin": 4}, {"x": 3, "y": 5, "w": 40, "h": 30, "bin": 8, "reduce": "mean"},
                   {"bin": 2}, {"bin": 64, "reduce": "mean"}, {"x": 60, "y": 40, "w": 500, "h": 500}, {"x": 999, "y": 999, "w": 1, "h": 1}):
        viewer.view(ident, max_hz=60, **fields)
        viewer.ready()
        while True:  # of the view before, perhaps
            header, pixels = viewer.picture()
            if header["bin"] == fields.get("bin", 1) and header["reduce"] == (fields.get("reduce") == "mean"):
                break
            viewer.ready()
        check(f"the view {fields} is what its bins give", pixels == reduced(file_of(folder, header), header) and header["frame"] >= last, header)
        last = header["frame"]
    viewer.texts.clear()
    while not viewer.texts:  # it comes behind a picture, twice a second at most
        viewer.ready()
        viewer.picture()
    told = viewer.text("histogram")
    check("the histogram of a view is that of all pixels", told["min"] <= told["p50"] <= told["p99"] <= told["max"] and
          {k: told[k] for k in expected} == histogram(file_of(folder, {"frame": int(told["frame"])}), header["bits"]), told)

    # Credit.
    viewer.view(ident, max_hz=60)
    viewer.ready()
    viewer.picture()
    viewer.ready()
    first = viewer.picture()[0]
    wait_for(lambda: json.loads(server.ask("/api/v1/state").text)["daemons"][0]["cameras"][0]["frame_id"] >= first["frame"] + 6)
    viewer.ready()
    second = viewer.picture()[0]
    check("who is not ready gets none, then the newest and how many were skipped", second["frame"] - first["frame"] >= 5 and
          second["skipped"] == second["frame"] - first["frame"] - 1, (first, second))
    try:
        more = viewer.picture(timeout=1)
    except TimeoutError:
        more = None
    check("and one picture only", more is None, more)
    viewer.input = b""
    for _ in range(50):
        viewer.ready()
    count, end = 0, time.monotonic() + 1.5
    while time.monotonic() < end:
        try:
            viewer.picture(timeout=max(0.01, end - time.monotonic()))
            count += 1
        except TimeoutError:
            break
    check("to be ready many times is to be ready once, and once more while the picture comes", 1 <= count <= 2, count)
    check("a daemon that nobody waits for copies no frames", wait_for(lambda: (lambda n: (time.sleep(0.5), copied(server) == n)[1])(copied(server))))
    before = copied(server)
    viewer.ready()
    header = viewer.picture()[0]
    check("and copies them again for the next that is", copied(server) > before or wait_for(lambda: copied(server) > before))

    slow_viewer(server, ident)

    # The rate that a viewer asks for, here after a rest, in which it had no share of what all may get.
    time.sleep(3.1)
    viewer.view(ident, max_hz=2)
    time.sleep(0.1)
    viewer.ready()
    edges = []
    for _ in range(6):
        edges.append(viewer.picture()[0]["edge_tai_ns"])
        viewer.ready()
    check("no more pictures than asked for", (edges[-1] - edges[1]) / 1e9 > 1.5, edges)

    # Messages that are refused.
    for message in ({"view": {"camera": ident, "bin": 3}}, {"view": {"camera": "x"}}, {"other": 1}, {"token": "again"}, {"ready": 1}):
        viewer.send_json(message)
        check(f"{json.dumps(message)} is answered with an error", viewer.text("error"))
    viewer.send(b"\x00", BINARY)
    check("so is a message that is no text", viewer.text("error"))
    viewer.view(f"{daemon.pid}-7")
    check("a camera that is not there is gone, with the reason", "no camera 7" in viewer.text("gone"))
    viewer.view("1-0")
    check("so is a daemon that is not there", viewer.text("gone"))
    viewer.view(ident)
    viewer.ready()
    check("and the viewer goes on", viewer.picture()[0]["frame"] > 0)

    # Who may look.
    check("without the protocol there is no upgrade", outcome(lambda: WebSocket(server.port, "/api/v1/live", protocol=None)) == 426)
    check("nor for another one", outcome(lambda: WebSocket(server.port, "/api/v1/live", protocol="obscura.v2")) == 426)
    check("nor without the request for one", server.ask("/api/v1/live").status == 426)
    check("another path is none", outcome(lambda: WebSocket(server.port, "/api/v1/dead")) == 404)
    check("another host is refused", outcome(lambda: WebSocket(server.port, "/api/v1/live", Host="bench.example.org")) == 421)
    check("a foreign origin is refused", outcome(lambda: WebSocket(server.port, "/api/v1/live", Origin="http://bench.example.org")) == 403)
    own = WebSocket(server.port, "/api/v1/live", Origin=f"http://localhost:{server.port}")
    begin = time.monotonic()
    silent = WebSocket(server.port, "/api/v1/live")
    check("who sends no token is told so and disconnected", "token" in json.loads(silent.receive()[1])["error"] and
          outcome(silent.receive) == 1008 and time.monotonic() - begin > 1.5)
    hasty = WebSocket(server.port, "/api/v1/live")
    hasty.send_json({"view": {"camera": ident}})
    check("the token comes first", "token" in json.loads(hasty.receive()[1])["error"] and outcome(hasty.receive) == 1008)
    wrong = Viewer(server.port, "wrong")
    check("a wrong token is refused", json.loads(wrong.receive()[1])["error"] == "this token is not known" and outcome(wrong.receive) == 1008)

    for client in own, silent, hasty, wrong:
        client.close()

    # JPEG, and pictures for players.
    painter = server.viewer()
    painter.view(ident, enc="jpeg", bin=2)
    jpegs = []
    while not jpegs:
        opcode, message = painter.receive()
        if opcode == BINARY:
            jpegs.append(message)
    at = struct.unpack_from("<H", jpegs[0], 6)[0]
    check("a picture of enc jpeg is one, of the size of the view", jpegs[0][51] == 1 and jpegs[0][at:at + 2] == b"\xff\xd8" and
          jpegs[0].endswith(b"\xff\xd9") and size_of_jpeg(jpegs[0][at:]) == (WIDTH // 2, HEIGHT // 2), jpegs[0][:80])
    painter.close()
    check("players are told of the scheme that they know", server.ask("/live.mjpg", Authorization="").headers["WWW-Authenticate"] == 'Basic realm="obscura"')

    def basic(password):
        return "Basic " + base64.b64encode(f"anybody:{password}".encode()).decode()

    check("a wrong password is refused", server.ask("/live.mjpg", Authorization=basic("wrong")).status == 401)
    check("and a password is for players only", server.ask("/api/v1/state", Authorization=basic(server.token)).status == 401)
    for path, headers in ("/live.mjpg", {"Authorization": basic(server.token)}), (f"/api/v1/cameras/{ident}/live.mjpg", {}):
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=PATIENCE_S)
        connection.request("GET", path, headers={"Authorization": f"Bearer {server.token}", **headers})
        answer = connection.getresponse()
        frames = []
        for _ in range(3):
            part = http.client.parse_headers(answer) if answer.readline() == b"--picture\r\n" else {}
            jpeg = answer.read(int(part.get("Content-Length", 0)))
            answer.readline()
            frames.append((int(part.get("X-Obscura-Frame", 0)), part.get("Content-Type"), jpeg and size_of_jpeg(jpeg)))
        check(f"{path} has pictures that go on", answer.headers["Content-Type"] == "multipart/x-mixed-replace; boundary=picture" and
              all(f[1:] == ("image/jpeg", (WIDTH, HEIGHT)) for f in frames) and sorted({f[0] for f in frames}) == [f[0] for f in frames], frames)
        check("and one more viewer is counted", wait_for(lambda: server.metric("obscura_web_viewers") == 2))
        answer.close()
        connection.close()
        check("until the player goes", wait_for(lambda: server.metric("obscura_web_viewers") == 1))
    check("pictures are counted", server.metric('obscura_web_frames_total{outcome="sent"}') > 10 and
          server.metric('obscura_web_requests_total{route="live",code="101"}') > 3)

    # Several viewers.
    others = []

    def joined(at):
        """One more: those that have just gone may still be counted."""
        try:
            others.append(server.viewer(source=f"127.0.0.{2 + at // 12}"))
        except Refused:
            return False
        return True

    for i in range(23):
        wait_for(lambda at=i: joined(at))
    for other in others:
        other.view(ident, bin=2)
    seen = [other.picture() for other in others]
    check("24 viewers see pictures", all(len(pixels) == WIDTH * HEIGHT // 4 for _, pixels in seen))
    check("one more is refused", outcome(lambda: server.viewer(source="127.0.0.9")) == 503)
    os.kill(server.process.pid, signal.SIGSTOP)
    counted = folder / "frames"
    before = len(list(counted.rglob("*.raw")))
    check("a server that is stopped stops no camera", wait_for(lambda: len(list(counted.rglob("*.raw"))) > before + 10))
    os.kill(server.process.pid, signal.SIGCONT)
    for other in others:
        other.close()

    # The daemon goes and comes.
    daemon.kill()
    daemon.wait()
    for file in counted.rglob("*.raw"):
        file.unlink()
    check("viewers are told that the daemon has gone", viewer.text("gone"))
    daemon = start(camera)
    ident = f"{daemon.pid}-0"
    check("it is found again", wait_for(lambda: [s for s in server.state()["daemons"] if s["daemon"]["pid"] == daemon.pid]))
    viewer.view(ident)
    viewer.ready()
    header, pixels = viewer.picture()
    check("and seen again", pixels == file_of(folder, header))

    # Frames that follow no rule.
    for what, data, codes in (("an unmasked frame", frame(b"{}", masked=False), (1002,)), ("a reserved bit", b"\xc1\x80\0\0\0\0", (1002,)),
                              ("a reserved opcode", b"\x83\x80\0\0\0\0", (1002,)), ("a long ping", frame(b"x" * 126, PING), (1002,)),
                              ("a ping in parts", frame(b"x", PING, final=False), (1002,)), ("no UTF-8", frame(b"\xff\xfe"), (1007,)),
                              ("a part without a begin", frame(b"x", 0), (1002,)), ("a message that is too long", frame(b"x" * 5000), (1009,)),
                              ("a length of 2^62", b"\x81\xff" + struct.pack(">Q", 1 << 62) + b"\0\0\0\0", (1009, 1002))):
        rude = server.viewer(source="127.0.0.5")
        rude.socket.sendall(data)

        def until_closed(client=rude):
            while True:
                client.receive()

        code = outcome(until_closed)
        check(f"{what}: the connection ends", code in codes, code)
        rude.close()
    parts = server.viewer()
    parts.socket.sendall(frame(b'{"view":', final=False) + frame(b"hello", PING) + frame(f'{{"camera":"{ident}"}}}}'.encode(), 0))
    check("a message in parts, with a ping between, is one message", parts.picture()[0]["w"] == WIDTH)
    parts.close()

    dice = random.Random(17)
    messages = [json.dumps(m).encode() for m in ({"view": {"camera": ident, "x": 3, "y": 4, "w": 30, "h": 20, "bin": 2, "reduce": "mean", "max_hz": 60}},
                                                 {"ready": True}, {"token": server.token})]
    sent, round_, slowest_s = 0, 0, 0
    while sent < MUTATED:
        round_ += 1
        if round_ % 20 == 1:
            begin = time.monotonic()
            server.ask("/livez")
            slowest_s = max(slowest_s, time.monotonic() - begin)
        rude = server.viewer(source=f"127.0.0.{10 + round_ % 50}")
        data = b""
        for _ in range(30):
            one = bytearray(dice.choice(messages))
            whole = dice.random() < 0.7  # the text is changed, the frame around it is right; or else all of it
            if not whole:
                one = bytearray(frame(bytes(one)))
            for _ in range(dice.randrange(1, 4)):
                at = dice.randrange(len(one))
                dice.choice([lambda: one.__setitem__(at, dice.randrange(256)), lambda: one.insert(at, dice.randrange(256)),
                             lambda: one.__delitem__(slice(at, at + dice.randrange(5))) if len(one) > 10 else None,
                             lambda: one.extend(one[at:at + 40])])()
            data += frame(bytes(one), dice.choice([TEXT, TEXT, TEXT, BINARY, PING]) if len(one) < 126 else TEXT) if whole else bytes(one)
            sent += 1
        try:
            rude.socket.sendall(data)
            rude.socket.shutdown(socket.SHUT_WR)
            while rude.socket.recv(65536):
                pass
        except OSError:
            pass
        rude.close()
    check(f"{sent} mutated messages are survived", server.process.poll() is None and server.ask("/livez").status == 200)
    viewer.ready()
    check("with pictures for the others", viewer.picture()[0]["frame"] >= header["frame"])
    check("memory stays below 64 MiB", server.resident_mib() < 64, server.resident_mib())
    print(f"# {server.resident_mib():.1f} MiB; longest answer of /livez meanwhile: {1e3 * slowest_s:.1f} ms")
    check("the server ends well with a viewer there", server.end() == 0)

    # Frames are not kept where that is not wanted.
    daemon.terminate()
    daemon.wait(PATIENCE_S)
    camera.config.write_text(camera.config.read_text().replace("[monitor]\n", "[monitor]\nframes = false\n"))
    daemon = start(camera)
    server = Web("--socket", camera.socket)
    check("a daemon without frames is found", wait_for(lambda: server.state()["daemons"]))
    viewer = server.viewer()
    viewer.view(f"{daemon.pid}-0")
    check("and its viewers are told so", "keeps no frames" in viewer.text("gone"))
    check("the server ends well", server.end() == 0)
    daemon.terminate()
    daemon.wait(PATIENCE_S)
sys.exit(1 if failures else 0)
