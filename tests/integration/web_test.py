#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura-web tells what a daemon does to those who have a token, and outlives clients that follow no rule.

Usage: web_test.py OBSCURAD OBSCURA OBSCURA-WEB SOURCE-DIRECTORY [MUTATED-REQUESTS (5000)]
Exit status 1 if a check failed.
"""
import gzip
import json
import os
import pathlib
import random
import re
import resource
import shutil
import socket
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import web_server  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

obscurad, obscura, web, source = sys.argv[1], sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4])
MUTATED = int(sys.argv[5]) if len(sys.argv) > 5 else 5000
PATIENCE_S = web_server.PATIENCE_S
EDITOR = ["models.js", "editor.js", "codemirror.js"]
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def lighter(file):
    """A script or style as it is served: the first line, and the others without comments and indentation."""
    first, *lines = file.read_text().splitlines()
    kept, comment = [first], False
    for line in map(str.lstrip, lines):
        comment = comment or line.startswith("/*")
        if not comment and line and not line.startswith("//"):
            kept.append(line)
        comment = comment and not line.rstrip().endswith("*/")
    return "\n".join(kept) + "\n"


def wait_for(condition):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.1)
    return False


def alive(server):
    """Whether health is told; a connection that is closed at once is none."""
    try:
        return server.ask("/livez", token="").status == 200
    except OSError:
        return False


def dripped(server):
    """Whether the server ends a connection whose request comes a byte at a time."""
    with socket.create_connection(("127.0.0.1", server.port), PATIENCE_S) as client:
        client.settimeout(0.05)
        for byte in b"GET / HTTP/1.1\r\nX: " + b"a" * 2000:
            try:
                client.sendall(bytes([byte]))
                if not client.recv(100):
                    return True
            except TimeoutError:
                continue
            except OSError:
                return True
    return False


class Web(web_server.Web):
    def __init__(self, *arguments):
        super().__init__(web, *arguments)


with tempfile.TemporaryDirectory(prefix="obscura-web-") as temporary:
    folder = pathlib.Path(temporary)
    camera = SmallDaemon(folder, obscurad, source)
    path = camera.socket

    one = Web("--socket", path)
    check("the link has a token of 43 characters", len(one.token) == 43, one.link)
    check("without a daemon it serves, and is not ready", one.ask("/livez").status == 200 and one.ask("/readyz").status == 503)
    daemon = camera.start()
    state = {}

    def complete():
        global state
        state = json.loads(one.ask("/api/v1/state").text)
        cameras = [camera for daemon in state["daemons"] for camera in daemon["cameras"]]  # none while the daemon starts
        return cameras[0]["camera"]["complete"] if cameras else 0

    check("it finds the daemon and its frames", wait_for(lambda: complete() > 3), state)
    # Its status is 1 where a busy machine made a frame late.
    told = json.loads(subprocess.run([obscura, "status", "--json", "--socket", path], capture_output=True, text=True).stdout)
    check("the state is that of the daemon", state["daemons"][0].keys() == told.keys() and
          state["daemons"][0]["daemon"]["pid"] == daemon.pid, state)
    # The two are asked at different instants: latencies have their lines once there is one.
    check("the metrics are those of obscura metrics, and its own", wait_for(lambda: [
        line for line in one.ask("/metrics").text.splitlines() if line.startswith("#") and " obscura_web_" not in line] ==
          [line for line in subprocess.run([obscura, "metrics", "--socket", path], capture_output=True, text=True,
                                           check=True).stdout.splitlines() if line.startswith("#")]))
    ready = one.ask("/readyz")
    told = json.loads(ready.text)
    check("readiness follows the verdict, which it tells", told["checks"]["daemon"] == "answers" and
          re.search(r"\d s$", told["checks"][f"{camera.config} camera 0"]) and
          told["ready"] == told["checks"][f"{camera.config} camera 0"].startswith(("on time", "idle")) and
          ready.status == (200 if told["ready"] else 503), ready.text)
    check("beside threads, clock and files", told["checks"][f"{camera.config} threads"] == "beat" and told["checks"][f"{camera.config} camera 0 clock"] ==
          "timer, free" and told["checks"][f"{camera.config} camera 0 files"] == "are written", ready.text)
    check("the log is there", json.loads(one.ask("/api/v1/events?follow=0").text)["events"][0]["id"] == 1)
    with socket.create_connection(("127.0.0.1", one.port), PATIENCE_S) as client:
        client.sendall(f"GET /api/v1/events HTTP/1.1\r\nHost: localhost:{one.port}\r\nAuthorization: Bearer {one.token}\r\n\r\n".encode())
        stream = b""
        while b"data: {" not in stream:
            stream += client.recv(4096)
        check("and comes as a stream", b"text/event-stream" in stream and re.search(rb"\nid: 1-[0-9a-f]{8}\ndata: {", stream), stream)
    streams = Web("--socket", path)  # streams whose clients have gone count until something is written to them

    def stream_after(last):
        """Begin of the stream of a client that was cut off after that event."""
        with socket.create_connection(("127.0.0.1", streams.port), PATIENCE_S) as client:
            client.sendall(f"GET /api/v1/events?after=0 HTTP/1.1\r\nHost: localhost:{streams.port}\r\nAuthorization: Bearer {streams.token}\r\n"
                           f"Last-Event-ID: {last}\r\n\r\n".encode())
            text = b""
            while b" 400 " not in text and (b"\nid: " not in text or not text.endswith(b"\n")):
                text += client.recv(4096)
            return text.decode()
    run = re.search(r"\nid: 1-([0-9a-f]{8})\n", stream_after("0")).group(1)
    check("a stream goes on after the last event", f"\nid: 2-{run}\n" in stream_after(f"1-{run}") and "\nid: 1-" not in stream_after(f"1-{run}") and
          f"\nid: 3-{run}\n" in stream_after("2"))
    check("ids of another run are not those of this one", re.search(r'event: lost\r?\ndata: {"lost":null}\n\nid: 1-', stream_after("2-0123abcd")))
    for wrong in "x", "-1", "1_2", "99999999999999999999999":
        check(f"Last-Event-ID: {wrong} is refused", " 400 " in stream_after(wrong).splitlines()[0])
    streams.end()
    page = one.ask("/", token="")
    check("the page needs no token and allows no other origin", page.status == 200 and
          "default-src 'none'" in page.headers["Content-Security-Policy"] and page.headers["X-Content-Type-Options"] == "nosniff")
    for name in "page.js", "page.css":
        check(f"{name} is the source's", one.ask(f"/{name}").text == lighter(source / "web/page" / name))
    check("nor may another page show it in a frame", "frame-ancestors 'none'" in page.headers["Content-Security-Policy"] and
          page.headers["X-Frame-Options"] == "DENY")
    version = re.search(r'src="(\w+)/page.js"', page.text).group(1)
    for coding, wanted in {"identity": None, "gzip": "gzip", "gzip, deflate, br": "gzip", "br;q=1, gzip;q=0": None, "*;q=0.5": "gzip", "gzip;q=x": None}.items():
        answer = one.ask("/page.js", token="", Accept_Encoding=coding)
        content = gzip.decompress(answer.content) if wanted else answer.content
        check(f"Accept-Encoding: {coding}: the same bytes", answer.headers["Content-Encoding"] == wanted and answer.headers["Vary"] == "Accept-Encoding" and
              content == lighter(source / "web/page/page.js").encode(), answer.headers)
        again = one.ask("/page.js", token="", Accept_Encoding=coding, If_None_Match=answer.headers["ETag"])
        check("which are not sent again", again.status == 304 and not again.content and again.headers["ETag"] == answer.headers["ETag"], again.headers)
    kept = one.ask(f"/{version}/vendor/preact-htm.js", token="", Accept_Encoding="gzip")
    check("files below the page's hash stay as they are", kept.status == 200 and "immutable" in kept.headers["Cache-Control"] and
          one.ask("/page.js", token="").headers["Cache-Control"] == "no-cache" and one.ask(f"/{version[:-1]}0x/page.js", token="").status == 404)
    sizes = [len(one.ask(file, token="", Accept_Encoding="gzip").content) for file in ["/"] + [
        f"/{path.relative_to(source / 'web/page')}" for path in (source / "web/page").rglob("*.*") if path.suffix in (".js", ".css", ".svg") and path.name not in EDITOR]]
    check("all of the page but the editor is at most 92 kB", 10 < len(sizes) and sum(sizes) <= 92000, sizes)
    editor = [len(one.ask(file, token="", Accept_Encoding="gzip").content) for file in ("/models.js", "/editor.js", "/vendor/codemirror.js")]
    check("the editor, which is loaded when it is opened, is at most 118 kB", sum(editor) <= 118000, editor)
    loaded = [name for name in EDITOR for path in (source / "web/page").glob("*.js") if path.name not in EDITOR and re.search(rf'^import .*{re.escape(name)}', path.read_text(), re.M)]
    check("no other screen loads it", loaded == [], loaded)
    print(f"{sum(sizes)} bytes compressed")
    head = one.ask("/", method="HEAD", token="")
    check("HEAD has the length and no body", head.status == 200 and int(head.headers["Content-Length"]) == len(page.text.encode()) and not head.text)

    # Where the body of a request ends is beyond doubt, or the connection ends (RFC 9112, 6.1): what follows is not answered.
    def statuses(request, follow=True):
        with socket.create_connection(("127.0.0.1", one.port), PATIENCE_S) as client:
            client.settimeout(PATIENCE_S)
            client.sendall(request.replace("\n", "\r\n").format(host=f"Host: localhost:{one.port}").encode() +
                           (f"GET /livez HTTP/1.1\r\nHost: localhost:{one.port}\r\nConnection: close\r\n\r\n".encode() if follow else b""))
            text = b""
            while part := client.recv(4096):
                text += part
        return [int(status) for status in re.findall(rb"HTTP/1\.[01] (\d+) ", text)]
    for coding in "gzip", "xchunked", "identity", "chunked, gzip", "gzip, chunked", "chunked\nTransfer-Encoding: chunked":
        check(f"Transfer-Encoding: {coding!r} is refused, and the connection ends",
              statuses("GET /livez HTTP/1.1\n{host}\nTransfer-Encoding: " + coding + "\n\n0\n\n") == [400])
    check("so is chunked of HTTP/1.0", statuses("GET /livez HTTP/1.0\n{host}\nTransfer-Encoding: chunked\nConnection: keep-alive\n\n0\n\n") == [400])
    check("chunked alone is read", statuses("GET /livez HTTP/1.1\n{host}\nTransfer-Encoding: Chunked\n\n0\n\n") == [200, 200])
    seen = statuses("POST /livez HTTP/1.1\n{host}\nContent-Length: 2\nExpect: 100-Continue\n\n{{}}")
    check("a client that expects 100 Continue gets it", seen == [100, 405, 200], seen)
    check("other expectations are refused", statuses("GET /livez HTTP/1.1\n{host}\nExpect: wonders\n\n") == [417])
    check("a target in absolute form is that of its path", statuses(f"GET http://localhost:{one.port}/livez HTTP/1.1\n{{host}}\n\n") == [200, 200] and
          statuses("GET HTTP://localhost HTTP/1.1\n{host}\n\n") == [200, 200])
    for scheme in "bearer", "BEARER", "Bearer  ":
        seen = statuses("GET /api/v1/state HTTP/1.1\n{host}\nAuthorization: " + f"{scheme} {one.token}\n\n")
        check(f"the scheme {scheme} is that of tokens", seen == [200, 200], seen)

    # Who may ask what.
    for route in "/metrics", "/readyz", "/api/v1/state", "/api/v1/events":
        check(f"{route} wants a token", one.ask(route, token="").status == 401)
    problem = one.ask("/api/v1/state", token="")
    check("a refusal is a problem with its cause", problem.headers["Content-Type"] == "application/problem+json" and
          json.loads(problem.text)["type"] == "urn:obscura:token" and problem.headers["WWW-Authenticate"] == "Bearer", problem.text)
    for host in "bench.example.org", "127.0.0.1", f"localhost:{one.port + 1}", f"localhost.:{one.port}", "":
        check(f"Host {host!r} is another server's", one.ask("/", Host=host).status == 421)
    check("names are not case-sensitive", one.ask("/", Host=f"LocalHost:{one.port}").status == 200)
    for origin in "http://bench.example.org", "null", f"https://localhost:{one.port}", "http://localhost":
        check(f"Origin {origin!r} is foreign", one.ask("/api/v1/state", Origin=origin).status == 403)
    check("the page's own origin is not", one.ask("/api/v1/state", Origin=f"http://127.0.0.1:{one.port}").status == 200)
    for method in "POST", "PUT", "PATCH", "DELETE", "OPTIONS", "TRACE":
        check(f"{method} is refused", one.ask("/api/v1/state", method=method).status == 405)
    for target in "/etc/passwd", "/../etc/passwd", "/page.js/", "//", "/%2e%2e/", "*", "/api/v1/state/x":
        check(f"{target} is no path", one.ask(target).status == 404)
    check("a value that is none is refused", one.ask("/api/v1/events?after=x").status == 422)

    # Other names, addresses and ports.
    named = Web("--socket", path, "--host", "https://Bench.example.org", "--host", "localhost:9000", "--host", "bench")
    for host, origin, wanted in ("bench.example.org", "https://bench.example.org", 200), ("bench.example.org:443", None, 200), ("localhost:9000", "http://localhost:9000", 200), \
            (f"bench:{named.port}", None, 200), ("bench.example.org", "http://bench.example.org", 403), ("bench.example.org:8420", None, 421), ("bench", None, 421), \
            ("localhost:9001", None, 421):
        headers = {"Host": host, **({"Origin": origin} if origin else {})}
        check(f"Host {host}, Origin {origin}: {wanted}", named.ask("/api/v1/me", **headers).status == wanted)
    wrong = json.loads(named.ask("/api/v1/me", Host="localhost:9001").text)["detail"]
    check("a wrong name is answered with the option that allows it", "--host localhost:9001 " in wrong, wrong)
    check("it ends well", named.end() == 0)
    with socket.create_server(("127.0.0.2", 0)) as free:
        other = free.getsockname()[1]
    several = Web("--socket", path, "--listen", f"127.0.0.2:{other}", "--host", "bench")

    def at_other(host):
        with socket.create_connection(("127.0.0.2", other), PATIENCE_S) as client:
            client.sendall(f"GET /livez HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
            return int(client.recv(4096).split()[1])
    check("a further address is served, too, by its own names", several.ask("/livez").status == 200 and
          [at_other(host) for host in (f"127.0.0.2:{other}", f"localhost:{other}", f"bench:{other}", f"evil:{other}")] == [200, 200, 200, 421])
    check("it ends well", several.end() == 0)
    for name in "a/b", "b:x", "", "https://", "b:0":
        refused = subprocess.run([web, "--host", name], capture_output=True, text=True)
        check(f"--host {name!r} is refused", refused.returncode == 64 and refused.stderr.count("\n") == 1, refused)
    for options, wanted in ((), "http://127.0.0.1:8420/"), (("--listen", "0.0.0.0:80"), "http://localhost:80/"), (("--listen", "192.0.2.1:8420", "--host", "bench"), "http://bench:8420/"), \
            (("--listen", "192.0.2.1:8420", "--host", "https://bench"), "https://bench/"), (("--listen", "[::1]:8420", "--host", "bench"), "http://[::1]:8420/"):
        link = subprocess.run([web, "--tokens", folder / "links", "--new-token", "viewer", *options], capture_output=True, text=True).stdout
        check(f"{' '.join(options) or 'the default address'}: the link is {wanted}", link.startswith(f"{wanted}#token="), link)

    # Bytes of clients that follow no rule, among them wrong tokens, after which an address waits: a server of their own.
    rude = Web("--socket", path, "--role", "operator")
    good = f"GET /api/v1/state HTTP/1.1\r\nHost: localhost:{rude.port}\r\nAuthorization: Bearer {rude.token}\r\n".encode()
    for what, data in {"an endless line": b"GET /" + b"a" * 300000, "an endless header": good + b"X: " + b"b" * 300000,
                       "headers without end": good + b"X-Y: z\r\n" * 20000,
                       "two lengths": good + b"Content-Length: 3\r\nContent-Length: 4\r\n\r\nabcd",
                       "a length and chunks": good + b"Content-Length: 3\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
                       "a body that is too long": good + b"Content-Length: 99999999\r\n\r\n" + b"c" * 100000,
                       "a chunk without end": good + b"Transfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n",
                       "line feeds alone": good.replace(b"\r\n", b"\n") + b"\n", "no protocol": b"\x16\x03\x01\x02\x00\x01" * 50,
                       "a negative length": good + b"Content-Length: -1\r\n\r\n"}.items():
        answer = rude.raw(data)
        check(f"{what}: refused, and the connection ends", not answer or answer.split()[1] in (b"400", b"413", b"431"), answer[:200])
    def whole_of_refused():
        """Whether all of a body can be sent although the answer is there, and no reset takes that back."""
        with socket.create_connection(("127.0.0.1", rude.port), PATIENCE_S) as client:
            try:
                client.sendall(good + b"Content-Length: 300000\r\n\r\n")
                answer = client.recv(65536)
                for _ in range(30):
                    client.sendall(b"c" * 10000)
                while part := client.recv(65536):
                    answer += part
            except OSError:
                return False
            return answer.startswith(b"HTTP/1.1 413 ")
    check("what a refused client still sends is read for a while", sum(whole_of_refused() for _ in range(10)) >= 8)  # a second, which may pass
    check("two hosts are none", b" 421 " in rude.raw(good + b"Host: localhost\r\nConnection: close\r\n\r\n"))
    dice = random.Random(11)
    body = b'{"Gain": 3, "TriggerSource": "Software", "x": [1, {"y": null}]}'
    wholes = [good + b"Connection: close\r\n\r\n",
              good.replace(b"GET /api/v1/state", f"PATCH /api/v1/cameras/{daemon.pid}-0/features?force=false".encode()) +
              b"Content-Type: application/json\r\nConnection: close\r\nContent-Length: %d\r\n\r\n" % len(body) + body]
    slowest_s = 0
    for number in range(MUTATED):
        if number % 500 == 0:
            begin = time.monotonic()
            rude.ask("/livez", token="")
            slowest_s = max(slowest_s, time.monotonic() - begin)
        data = bytearray(wholes[number % 2])
        for _ in range(dice.randrange(1, 6)):
            at = dice.randrange(len(data))
            dice.choice([lambda: data.__setitem__(at, dice.randrange(256)), lambda: data.insert(at, dice.randrange(256)),
                         lambda: data.__delitem__(slice(at, at + dice.randrange(20))) if len(data) > 60 else None,
                         lambda: data.extend(data[at:at + 40])])()
        with socket.create_connection(("127.0.0.1", rude.port), PATIENCE_S) as client:
            client.sendall(data)
            client.shutdown(socket.SHUT_WR)
            try:
                while client.recv(65536):
                    pass
            except ConnectionResetError:
                pass
    check(f"{MUTATED} mutated requests are survived", rude.process.poll() is None and rude.ask("/livez").status == 200)
    check("its memory stays below 64 MiB", rude.resident_mib() < 64, rude.resident_mib())
    print(f"# {rude.resident_mib():.1f} MiB; longest answer of /livez meanwhile: {1e3 * slowest_s:.1f} ms")
    check("it ends well", rude.end() == 0)

    idle = [socket.create_connection(("127.0.0.1", one.port), PATIENCE_S) for _ in range(64)]
    check("beside idle connections health is told, and nothing else", wait_for(lambda: one.ask("/api/v1/state").status == 503) and one.ask("/livez").status == 200)
    many = [socket.create_connection(("127.0.0.1", one.port), PATIENCE_S) for _ in range(200)]
    for client in idle + many:
        client.close()
    check("and all once they have gone", wait_for(lambda: one.ask("/api/v1/state").status == 200))
    # Users behind one proxy: connections that have shown a token are those of its session, not of the address.
    admitted, refused = [], 0
    for _ in range(140):
        client = one.connection()
        client.request("GET", "/api/v1/state", headers={"Authorization": f"Bearer {one.token}"})
        answer = client.getresponse()
        answer.read()
        admitted.append(client)
        refused += answer.status == 503
    check("128 connections of one session from one address are served, more are not", 12 <= refused <= 14, refused)  # others may still be open
    check("and the address is not kept out by them", one.ask("/livez").status == 200 and one.ask("/").status == 200)
    for client in admitted:
        client.close()
    check("and the session again once they have gone", wait_for(lambda: one.ask("/api/v1/state").status == 200))
    # From many addresses, so that one address's limit does not keep them out.
    crowd = []
    for number in range(1000):
        client = socket.socket()
        client.bind((f"127.0.1.{1 + number % 250}", 0))
        client.settimeout(PATIENCE_S)
        client.connect(("127.0.0.1", one.port))
        crowd.append(client)
    check("beside 1000 idle sockets health is told", wait_for(lambda: alive(one)) and one.resident_mib() < 64, one.resident_mib())
    begin = time.monotonic()
    alive(one)
    print(f"# beside 1000 idle sockets: {one.resident_mib():.1f} MiB, /livez {1e3 * (time.monotonic() - begin):.1f} ms")
    for client in crowd:
        client.close()
    check("and all once they have gone", wait_for(lambda: one.ask("/api/v1/state").status == 200))
    slow = socket.create_connection(("127.0.0.1", one.port), PATIENCE_S)
    slow.sendall(b"GET / HTTP/1.1\r\nHost: lo")
    check("a header that does not come in time ends the connection", slow.recv(10) == b"")
    check("nor does one that comes byte by byte keep it", dripped(one))

    # Its own metrics.
    values = dict(re.findall(r"^(obscura_web_\S+) (\S+)$", one.ask("/metrics").text, re.M))
    before = {key: float(value) for key, value in values.items()}
    for _ in range(3):
        one.ask("/api/v1/me")
    one.ask("/nowhere")
    after = {key: float(value) for key, value in re.findall(r"^(obscura_web_\S+) (\S+)$", one.ask("/metrics").text, re.M)}
    grown = {key: value - before.get(key, 0) for key, value in after.items()}
    check("requests are counted by route and status", grown['obscura_web_requests_total{route="me",code="200"}'] == 3 and
          grown['obscura_web_requests_total{route="other",code="404"}'] == 1 and grown['obscura_web_requests_total{route="metrics",code="200"}'] == 1, grown)
    check("and their bytes", 3 * 200 < grown["obscura_web_bytes_total"] < 200000, grown)
    routes = set(re.findall(r'route="([^"]*)"', " ".join(after)))
    check("labels are those of the table", routes <= {o["operationId"] for item in json.loads(one.ask("/api/v1/openapi.json").text)["paths"].values()
                                                      for o in item.values()} | {"other", "live", "unreadable"}, routes)
    families = set(re.findall(r"^# TYPE (obscura_web_\S+)", one.ask("/metrics").text, re.M))
    check("their names are those of docs/control.md, and those that the alert rules and the dashboard use", families == set(
        re.findall(r"`(obscura_web_[a-z_]+)", (source / "docs/control.md").read_text())) and set(
        re.findall(r"obscura_web_[a-z_]+", "".join((source / "config/monitoring" / f).read_text() for f in ("alerts.yml", "dashboard.json")))) <= families, families)
    if shutil.which("promtool"):
        told = subprocess.run(["promtool", "check", "metrics"], input=one.ask("/metrics").text, capture_output=True, text=True)
        check("promtool has nothing to say", told.returncode == 0, told.stdout + told.stderr)

    # A client that cannot be accepted waits on, and the server must not try again and again.
    limits = resource.prlimit(one.process.pid, resource.RLIMIT_NOFILE)
    resource.prlimit(one.process.pid, resource.RLIMIT_NOFILE, (len(os.listdir(f"/proc/{one.process.pid}/fd")) + 2, limits[1]))
    many = [socket.create_connection(("127.0.0.1", one.port), PATIENCE_S) for _ in range(8)]
    time.sleep(0.5)
    before = one.processor_s()
    time.sleep(1)
    check("without descriptors it rests", one.processor_s() - before < 0.5, one.processor_s() - before)
    resource.prlimit(one.process.pid, resource.RLIMIT_NOFILE, limits)
    for client in many:
        client.close()
    check("and serves once there are some", wait_for(lambda: one.ask("/api/v1/state").status == 200))

    daemon.kill()
    daemon.wait()
    check("a daemon that has gone is not ready", wait_for(lambda: one.ask("/readyz").status == 503 and not json.loads(
        one.ask("/api/v1/state").text)["daemons"]))
    daemon = camera.start()
    check("and is found again", wait_for(lambda: complete() > 0))
    for _ in range(5):
        one.ask("/metrics", token="wrong")
    check("after five wrong tokens the address waits, but for those who have the right one", one.ask("/metrics", token="wrong").status == 429 and
          one.ask("/metrics").status == 200)
    check("it ends well", one.end() == 0)

    # Tokens of a file.
    tokens = folder / "tokens"
    link = subprocess.run([web, "--tokens", tokens, "--new-token", "viewer"], capture_output=True, text=True, check=True).stdout.strip()
    token = link.partition("token=")[2]
    check("the file does not hold the token", token and token not in tokens.read_text() and tokens.stat().st_mode & 0o7 == 0, link)
    two = Web("--socket", path, "--tokens", tokens)
    check("with a file no token is printed, and its own are known", not two.token and two.ask("/metrics", token=token).status == 200)
    check("it ends well", two.end() == 0)
    daemon.terminate()
    daemon.wait(PATIENCE_S)
    tokens.write_text("viewer 123\n")
    refused = subprocess.run([web, "--tokens", tokens], capture_output=True, text=True)
    check("a bad file is refused with its line", refused.returncode == 66 and refused.stderr.startswith(f"{tokens}:1: ") and
          refused.stderr.count("\n") == 1, refused)
    for address in "0.0.0.0:8420", "[::]:8420", "192.0.2.1:8420":
        refused = subprocess.run([web, "--listen", address], capture_output=True, text=True)
        check(f"{address} is refused without --insecure", refused.returncode == 78 and refused.stderr.count("\n") == 1, refused)
    refused = subprocess.run([web, "--listen", "nowhere"], capture_output=True, text=True)
    check("what is no address is refused", refused.returncode == 66 and "allowed" in refused.stderr, refused)
sys.exit(1 if failures else 0)
