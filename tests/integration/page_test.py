#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page of obscura-web in a browser before a running camera: what it shows is what the daemon says, and the browser complains of nothing.

Usage: page_test.py OBSCURAD OBSCURA OBSCURA-WEB SOURCE-DIRECTORY OUTPUT-FOLDER [--picture FILE]
Leaves pictures of the page in the folder, to be looked at; all screens are in those of page_screens_test.py. With --picture also writes
the one of the manual. Exit status 77 without Chromium (Debian package chromium), 1 if a check failed.
"""
import json
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import browser  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

obscurad, obscura, web, source, output = sys.argv[1], sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4]), pathlib.Path(sys.argv[5])
shown = pathlib.Path(sys.argv[7]) if sys.argv[6:7] == ["--picture"] else None
PATIENCE_S = 120
failures = []
if browser.missing():
    print(f"skipped: {browser.missing()}")
    sys.exit(77)


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)[:2000]}", flush=True)
    if not good:
        failures.append(what)


def go(window, screen):
    window.evaluate(f"location.hash = '{screen}'")
    window.wait_for(f"document.querySelector('nav a[aria-current]')?.getAttribute('href') === '#{screen}'")


def rows_of(window, label):
    """Names and values of a table of facts."""
    return dict(window.evaluate(f"[...document.querySelectorAll('table[aria-label={json.dumps(label)}] tr')].map((r) => [...r.children].map((c) => c.textContent.replaceAll('\\u202f', '')))"))


output.mkdir(parents=True, exist_ok=True)
with tempfile.TemporaryDirectory(prefix="obscura-page-") as temporary, browser.Browser() as window:
    folder = pathlib.Path(temporary)
    camera = SmallDaemon(folder, obscurad, source, name="camera <1> &amp.toml")  # names are texts in the page
    path = camera.socket
    daemon = camera.start()
    server = subprocess.Popen([web, "--listen", "127.0.0.1:0", "--socket", path], stdout=subprocess.PIPE, text=True)
    link = server.stdout.readline().strip()

    def state():
        answer = subprocess.run([obscura, "status", "--json", "--socket", path], capture_output=True, text=True)
        return json.loads(answer.stdout)["cameras"][0] if answer.stdout else None

    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end and not ((told := state()) and told["camera"]["complete"] > 20):
        time.sleep(0.2)
    before = state()
    window.open(link)
    go(window, "timing")
    window.wait_for(f"Number(document.querySelectorAll('table[aria-label=\"Triggers and frames\"] td')[1]?.textContent) > {before['camera']['complete']}")
    rows = rows_of(window, "Triggers and frames")
    after = state()
    check("the page counts as the daemon does", before["camera"]["complete"] <= int(rows.get("frames complete", -1)) <= after["camera"]["complete"], rows)
    check("each reason of a missed trigger has its row", rows_of(window, "Missed triggers by reason").keys() == {reason.replace("_", " ") for reason in after["camera"]["missed_because"]})
    check("there are histograms of what the daemon tells", window.evaluate("document.querySelectorAll('.histogram svg[role=img]').length") >= 3)
    verdict = window.text("#verdict")
    check("it shows the verdict", re.search(r"last \d+ s$", verdict), verdict)
    go(window, "transports")
    rows = rows_of(window, "Address")
    check("it shows where the camera is, and who controls it", rows == {"GigE Vision": after["address"], "controlled by": after["controller"] or "nobody"}, rows)
    go(window, "system")
    window.wait_for("document.querySelectorAll('#log tbody tr').length > 2")
    check("the log is there", "starting with" in window.text("#log"))
    check("a name with markup is text", rows_of(window, "Daemon")["configuration"].endswith("camera <1> &amp.toml"), rows_of(window, "Daemon"))
    # Paths that this server does not have are refused, and the browser lists that.
    complaints = [c for c in window.complaints if not c.startswith("network:")]
    check("the browser complains of nothing", complaints == [], complaints)
    for theme in "dark", "light":
        window.prefer(theme)
        for width in 1280, 1920:
            window.resize(width, 1080)
            window.open("about:blank")
            window.open(link)
            time.sleep(1.5)
            window.screenshot(output / f"page-{theme}-{width}.png")
    if shown:
        shutil.copy(output / "page-dark-1280.png", shown)
    window.resize(1280, 900)
    window.open("about:blank")
    window.open(link.split("token=")[0] + "token=wrong")
    check("with a wrong token it says what to do, and shows nothing", window.wait_for("document.querySelector('#verdict')?.textContent.includes('This token is not known')") and not window.text("main"))
    window.open("about:blank")
    window.open(link)
    window.wait_for("document.querySelector('#verdict')?.textContent.includes('last')")
    daemon.send_signal(signal.SIGKILL)
    daemon.wait()
    check("without the daemon it says so", window.wait_for("document.querySelector('#verdict').textContent.startsWith('No camera: ') && !document.querySelector('main').textContent"), window.text("#verdict"))
    server.terminate()
    server.wait(PATIENCE_S)
sys.exit(1 if failures else 0)
