#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page of obscura-web in a browser: what it shows is what the daemon says, in all themes, and the browser complains of nothing.

Usage: page_test.py OBSCURAD OBSCURA OBSCURA-WEB SOURCE-DIRECTORY OUTPUT-FOLDER [--picture FILE]
Leaves pictures of the page in the folder, to be looked at. With --picture also writes the one of the manual. Exit status 77
without Chromium (Debian package chromium), 1 if a check failed.
"""
import html
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
from small_daemon import SmallDaemon  # noqa: E402

obscurad, obscura, web, source, output = sys.argv[1], sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4]), pathlib.Path(sys.argv[5])
shown = pathlib.Path(sys.argv[7]) if sys.argv[6:7] == ["--picture"] else None
PATIENCE_S = 120
failures = []
if not shutil.which("chromium"):
    print("skipped: Chromium is not installed (Debian package chromium)")
    sys.exit(77)


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def browse(url, *arguments):
    return subprocess.run(["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=6000",
                           "--enable-logging=stderr", *arguments, url], capture_output=True, text=True, timeout=PATIENCE_S)


def texts(dom):
    """Names and values of the tables' rows."""
    return {html.unescape(name): html.unescape(value)
            for name, value in re.findall(r'<th scope="row">([^<]*)</th><td class="number[^"]*">([^<]*)</td>', dom)}


output.mkdir(parents=True, exist_ok=True)
with tempfile.TemporaryDirectory(prefix="obscura-page-") as temporary:
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
    before = state()["camera"]["complete"]
    # A daemon that stands still says what the page shows.
    page = browse(link, "--dump-dom")
    after = state()
    rows = texts(page.stdout)
    check("the page counts as the daemon does", before <= int(rows.get("frames complete", -1)) <= after["camera"]["complete"], rows)
    check("it shows the verdict", re.search(r'class="verdict (good|bad|idle)">[^<]*last \d+ s', page.stdout) is not None, page.stdout[:3000])
    for name, value in {"address": after["address"], "controlled by": after["controller"] or "nobody", "acquisition": "runs"}.items():
        check(f"it shows: {name}", rows.get(name) == value, rows)
    check("each reason of a missed trigger has its row", all(reason.replace("_", " ") in rows for reason in after["camera"]["missed_because"]))
    check("there are three histograms with a description", page.stdout.count('role="img"') == 3 and 'aria-label="Trigger to first row: median' in page.stdout)
    check("a name with markup is text", "camera &lt;1&gt; &amp;amp.toml" in page.stdout)
    check("the log is there", "starting with" in page.stdout)
    console = [line for line in page.stderr.splitlines() if "CONSOLE" in line]
    check("the browser complains of nothing", not console, console)
    wrong = browse(link.split("token=")[0] + "token=wrong", "--dump-dom")
    check("with a wrong token it says what to do", "This token is not known" in wrong.stdout and "frames complete" not in wrong.stdout)
    for width in 1280, 1920:
        for theme in "dark", "light":
            file = output / f"page-{theme}-{width}.png"
            browse(link, f"--window-size={width},{1080}", f"--screenshot={file}",
                   f"--blink-settings=preferredColorScheme={0 if theme == 'dark' else 1}")
            check(f"{file} was made", file.exists() and file.stat().st_size > 10000)
    if shown:
        shutil.copy(output / "page-dark-1280.png", shown)
    daemon.send_signal(signal.SIGKILL)
    daemon.wait()
    time.sleep(1.5)
    gone = browse(link, "--dump-dom")
    check("without the daemon it says so", "No camera: " in gone.stdout and "frames complete" not in gone.stdout, gone.stdout[:2000])
    server.terminate()
    server.wait(PATIENCE_S)
sys.exit(1 if failures else 0)
