#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura-web tells what a daemon does to those who have a token, and outlives clients that follow no rule.

Usage: web_test.py OBSCURAD OBSCURA OBSCURA-WEB SOURCE-DIRECTORY [MUTATED-REQUESTS (5000)]
Exit status 1 if a check failed.
"""
import json
import pathlib
import random
import re
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
failures = []


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
        return state["daemons"] and state["daemons"][0]["cameras"][0]["camera"]["complete"] or 0

    check("it finds the daemon and its frames", wait_for(lambda: complete() > 3), state)
    # Its status is 1 where a busy machine made a frame late.
    told = json.loads(subprocess.run([obscura, "status", "--json", "--socket", path], capture_output=True, text=True).stdout)
    check("the state is that of the daemon", state["daemons"][0].keys() == told.keys() and
          state["daemons"][0]["daemon"]["pid"] == daemon.pid, state)
    # Of two instants: latencies have their lines once there is one.
    check("the metrics are those of obscura metrics", wait_for(lambda: [line for line in one.ask("/metrics").text.splitlines() if line.startswith("#")] ==
          [line for line in subprocess.run([obscura, "metrics", "--socket", path], capture_output=True, text=True,
                                           check=True).stdout.splitlines() if line.startswith("#")]))
    ready = one.ask("/readyz")
    told = json.loads(ready.text)
    check("readiness follows the verdict, which it tells", told["checks"]["daemon"] == "answers" and
          re.search(r"last \d+ s$", told["checks"][f"{camera.config} camera 0"]) and
          told["ready"] == told["checks"][f"{camera.config} camera 0"].startswith(("on time", "idle")) and
          ready.status == (200 if told["ready"] else 503), ready.text)
    check("the log is there", json.loads(one.ask("/api/v1/events?follow=0").text)["events"][0]["id"] == 1)
    with socket.create_connection(("127.0.0.1", one.port), PATIENCE_S) as client:
        client.sendall(f"GET /api/v1/events HTTP/1.1\r\nHost: localhost:{one.port}\r\nAuthorization: Bearer {one.token}\r\n\r\n".encode())
        stream = b""
        while b"data: {" not in stream:
            stream += client.recv(4096)
        check("and comes as a stream", b"text/event-stream" in stream and b"id: 1\n" in stream, stream)
    page = one.ask("/", token="")
    check("the page needs no token and allows no other origin", page.status == 200 and
          "default-src 'none'" in page.headers["Content-Security-Policy"] and page.headers["X-Content-Type-Options"] == "nosniff")
    for name in "page.js", "page.css":
        check(f"{name} is the source's", one.ask(f"/{name}").text == (source / "web/page" / name).read_text())
    head = one.ask("/", method="HEAD", token="")
    check("HEAD has the length and no body", head.status == 200 and int(head.headers["Content-Length"]) == len(page.text.encode()) and not head.text)

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
    check("two hosts are none", b" 421 " in rude.raw(good + b"Host: localhost\r\nConnection: close\r\n\r\n"))
    dice = random.Random(11)
    body = b'{"Gain": 3, "TriggerSource": "Software", "x": [1, {"y": null}]}'
    wholes = [good + b"Connection: close\r\n\r\n",
              good.replace(b"GET /api/v1/state", f"PATCH /api/v1/cameras/{daemon.pid}-0/features?force=false".encode()) +
              b"Content-Type: application/json\r\nConnection: close\r\nContent-Length: %d\r\n\r\n" % len(body) + body]
    for number in range(MUTATED):
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
    check("it ends well", rude.end() == 0)

    idle = [socket.create_connection(("127.0.0.1", one.port), PATIENCE_S) for _ in range(16)]
    time.sleep(0.5)
    check("beside idle connections health is told, and nothing else", one.ask("/livez").status == 200 and one.ask("/api/v1/state").status == 503)
    many = [socket.create_connection(("127.0.0.1", one.port), PATIENCE_S) for _ in range(200)]
    for client in idle + many:
        client.close()
    check("and all once they have gone", wait_for(lambda: one.ask("/api/v1/state").status == 200))
    slow = socket.create_connection(("127.0.0.1", one.port), PATIENCE_S)
    slow.sendall(b"GET / HTTP/1.1\r\nHost: lo")
    check("a header that does not come in time ends the connection", slow.recv(10) == b"")

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
