#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Pages of other sites in a real browser, which know the token: they neither read from obscura-web nor change anything, show its page in none of their
frames, and do not get there by a name of theirs that is pointed at this machine.

Usage: page_attacks_test.py OBSCURA-WEB
Exit status 77 without Chromium, 1 if a check failed.
"""
import atexit
import http.server
import json
import pathlib
import re
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import browser  # noqa: E402
import web_server  # noqa: E402
from checks import check, failures  # noqa: E402

if why := browser.missing():
    print(f"skipped: {why}")
    sys.exit(77)
web = sys.argv[1]


class OtherSite(http.server.BaseHTTPRequestHandler):
    """A page without anything, and without a policy that would keep it from something."""

    def do_GET(self):
        body = b"<!doctype html><title>other site</title><body></body>"
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        pass


other = http.server.ThreadingHTTPServer(("127.0.0.1", 0), OtherSite)
threading.Thread(target=other.serve_forever, daemon=True).start()
with tempfile.TemporaryDirectory(prefix="obscura-attacks-") as folder, \
        browser.Browser(arguments=["--host-resolver-rules=MAP *.test 127.0.0.1"]) as window:
    server = web_server.Web(web, "--socket", f"{folder}/none", "--role", "admin")
    atexit.register(server.process.kill)
    own, command = f"http://127.0.0.1:{server.port}", "/api/v1/cameras/1-0/trigger"

    def answered(code):
        """Answers with that status so far."""
        return sum(float(count) for count in re.findall(rf'^obscura_web_requests_total{{route="[^"]*",code="{code}"}} (\S+)$', server.ask("/metrics").text, re.M))

    window.open(f"{own}/")
    check("the page itself is there", window.evaluate("document.title") != "" and window.evaluate("document.querySelector('script[src]') !== null"))
    read = window.evaluate(f"fetch('api/v1/audit', {{headers: {{Authorization: 'Bearer {server.token}'}}}}).then((a) => a.status)")
    check("and may ask", read == 200, read)

    window.open(f"http://attacker.test:{server.port}/")
    text = window.evaluate("document.body.innerText")
    check("under a name that was pointed here there is no page", "urn:obscura:wrong-host" in text and answered(421) >= 1, text)
    read = window.evaluate(f"fetch('/api/v1/audit', {{headers: {{Authorization: 'Bearer {server.token}'}}}}).then((a) => a.status)")
    check("nor anything else", read == 421, read)

    window.open(f"http://attacker.test:{other.server_port}/")
    for name, options in ("a question", "{headers: {Authorization: 'Bearer TOKEN'}}"), ("one without a token", "{}"), \
            ("a command", "{method: 'POST', body: '{}', headers: {Authorization: 'Bearer TOKEN', 'Content-Type': 'application/json'}}"):
        told = window.evaluate(f"fetch('{own}{command}', {options.replace('TOKEN', server.token)}).then((a) => `read ${{a.status}}`, (e) => e.name)")
        check(f"{name} of another site's page is answered with nothing that it may read", told == "TypeError", told)
    before = answered(403)
    told = window.evaluate(f"fetch('{own}{command}', {{method: 'POST', mode: 'no-cors', body: '{{}}', headers: {{'Content-Type': 'text/plain'}}}}).then((a) => a.type, (e) => e.name)")
    check("one that needs no permission of ours to be sent is refused", told in ("opaque", "TypeError") and answered(403) > before, (told, before, answered(403)))
    for kind in "application/x-www-form-urlencoded", "multipart/form-data", "text/plain":
        before = answered(403)
        window.evaluate(f"""(() => {{ const frame = document.createElement('iframe'), form = document.createElement('form');
            frame.name = form.target = 'frame of {kind}'; form.method = 'post'; form.action = '{own}{command}'; form.enctype = '{kind}';
            form.innerHTML = '<input name="{{" value="}}">'; document.body.append(frame, form); form.submit(); }})()""")
        end = time.monotonic() + web_server.PATIENCE_S
        while answered(403) == before and time.monotonic() < end:
            time.sleep(0.1)
        check(f"so is a form of {kind}", answered(403) > before, answered(403))
    told = window.evaluate(f"""new Promise((done) => {{ const s = new WebSocket('{own.replace('http', 'ws')}/api/v1/live', 'obscura.v1');
        s.onopen = () => done('open'); s.onerror = () => done('error'); }})""")
    check("so is a WebSocket", told == "error", told)

    window.complaints.clear()
    told = window.evaluate(f"""new Promise((done) => {{ const frame = document.createElement('iframe');
        frame.onload = () => {{ try {{ done(frame.contentDocument ? 'empty' : 'another origin'); }} catch (e) {{ done(e.name); }} }};
        frame.src = '{own}/'; document.body.append(frame); setTimeout(() => done('nothing'), 20000); }})""")
    window.evaluate("new Promise((done) => setTimeout(done, 500))")
    check("its page is not shown in a frame", any("frame-ancestors" in complaint for complaint in window.complaints), (told, window.complaints))

    audit = json.loads(server.ask("/api/v1/audit").text)
    check("nothing has been changed", audit["changes"] == [], audit)
    check("it ends well", server.end() == 0)
sys.exit(1 if failures else 0)
