#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page of obscura-web in a browser before a running camera: what it shows is what the daemon says, and the browser complains of nothing.

Usage: page_test.py OBSCURAD OBSCURA OBSCURA-WEB SOURCE-DIRECTORY OUTPUT-FOLDER [--picture FILE]
Leaves pictures of the page in the folder, to be looked at; all screens are in those of page_screens_test.py. With --picture it only makes
the one of the manual, of the demonstration's scene. Exit status 77 without Chromium (Debian package chromium), 1 if a check failed.
"""
import json
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import browser  # noqa: E402
from children import Child  # noqa: E402
from checks import until  # noqa: E402
from page_view import PATIENCE_S, Api, drawn, go, place_of, rows_of, there  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

obscurad, obscura, web, source, output = sys.argv[1], sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4]), pathlib.Path(sys.argv[5])
shown = pathlib.Path(sys.argv[7]) if sys.argv[6:7] == ["--picture"] else None
failures = []
if browser.missing():
    print(f"skipped: {browser.missing()}")
    sys.exit(77)


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)[:2000]}", flush=True)
    if not good:
        failures.append(what)


def live_screen(window, api):
    """One frame by software trigger: its numbers in the probe, as electrons and in the histogram."""
    camera = api.json("state")["daemons"][0]["cameras"][0]["id"]
    go(window, "live")
    check("live pictures come", window.wait_for("document.querySelector('table[aria-label=Frame]')"), window.text(".stage-note"))
    api.ask(f"cameras/{camera}/features", "PATCH", {"TriggerSource": "Software"})
    # A frame of the timer may still be in progress.
    told = until(lambda: api.json(f"cameras/{camera}/trigger", "POST", {}), lambda told: told.get("outcome") in ("complete", "late"))
    frame = str(told["frame"])
    check("the page shows the frame that was triggered", window.wait_for(f"document.querySelector('table[aria-label=Frame] td').textContent === '{frame}'"), (told, rows_of(window, "Frame")))
    window.evaluate("[...document.querySelectorAll('.toolbar button')].find((b) => b.textContent === '1:1').click()")
    window.wait_for("document.querySelector('.scale').textContent === '100 %' && document.querySelector('table[aria-label=Frame]').textContent.includes('single pixels')")
    known = api.json(f"cameras/{camera}/frames/latest.json")
    pixels = memoryview(api.ask(f"cameras/{camera}/frames/{known['id']}.raw")).cast("H").tolist()
    width, height, full = known["width"], known["height"], 2 ** known["bits"] - 1
    left, top, wide, high = place_of(window)
    x, y = width // 2, height // 2
    window.mouse("Moved", left + (wide - width) // 2 + x + 0.5, top + (high - height) // 2 + y + 0.5)
    found = window.wait_for("document.querySelector('#probe-dn').textContent !== '–'") and rows_of(window, "Probe")
    check("the probe follows the mouse", found and (found["x, y"], found["DN"]) == (f"{x}, {y}", str(pixels[y * width + x])), (found, pixels[y * width + x]))
    entries, values = api.json(f"cameras/{camera}/configuration")["entries"], {row["name"]: row["value"] for row in api.json(f"cameras/{camera}/features")["features"]}
    gain = next(float(entry["value"]) for entry in entries if entry["key"].endswith("detector.gain_dn_per_e"))
    electrons = (pixels[y * width + x] - values["BlackLevel"]) / (gain * 10 ** (values["Gain"] / 20))
    shown = window.wait_for("document.querySelector('#probe-electrons').textContent !== '–' && document.querySelector('#probe-electrons').textContent")
    check("electrons are those of the linear model", abs(float(shown.replace("\u202f", "")) - electrons) <= 1e-4 * abs(electrons) + 0.5, (shown, electrons))
    window.wait_for(f"document.querySelector('.side').textContent.includes('Of all pixels of frame {frame}')")
    told = rows_of(window, "Digital numbers")
    check("histogram and saturated pixels are those of the frame", told["saturated pixels"] == str(sum(dn >= full for dn in pixels)) and told["least, most"] == f"{min(pixels)}, {max(pixels)} DN", told)
    go(window, "camera")
    window.wait_for("document.querySelector('#f-Gain')")
    rows = {row["name"]: row for row in api.json(f"cameras/{camera}/features")["features"]}
    shown = window.evaluate("Object.fromEntries([...document.querySelectorAll('.features tbody tr')].map((r) => [r.children[0].textContent, r.querySelector('[type=checkbox]') ? r.querySelector('input').checked : r.querySelector('input,select').value]))")
    same = {name: (str(shown.get(name)) == str(row["value"]) or (isinstance(row["value"], (int, float)) and float(shown[name]) == row["value"])) for name, row in rows.items()}
    check("every feature stands there with its value", all(same.values()), [name for name in same if not same[name]])
    api.ask(f"cameras/{camera}/features", "PATCH", {"TriggerSource": "Line0"})


def picture(window, folder):
    """The demonstration's camera on the page."""
    config = (source / "config/demo.toml").read_text().replace('file = "scenes', f'file = "{(source / "config/scenes").resolve()}').replace('interface = "lo"', "enabled = false")
    config = config.replace('unix_socket = "auto"', f'unix_socket = "{folder}/calls"')
    (folder / "demo.toml").write_text(f'{config}\n[monitor]\nsocket = "{folder}/monitor"\n')
    daemon = Child([obscurad, "--config", folder / "demo.toml"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end and not (folder / "monitor").exists():
        time.sleep(0.2)
    server = Child([web, "--listen", "127.0.0.1:0", "--role", "operator", "--socket", folder / "monitor"], stdout=subprocess.PIPE, text=True)
    window.prefer("dark")
    window.open(server.stdout.readline().strip())
    go(window, "live")
    window.wait_for("document.querySelector('table[aria-label=Frame]') && document.querySelector('.dn-histogram') && document.querySelector('.overlay')")
    window.wait_for("document.querySelector('#verdict').textContent.includes('on time')")
    window.mouse("Moved", 560, 590)
    window.wait_for("document.querySelector('#probe-dn').textContent !== '–'")
    drawn(window)
    window.screenshot(shown)
    for process in server, daemon:
        process.terminate()
        process.wait(PATIENCE_S)


output.mkdir(parents=True, exist_ok=True)
if shown:
    with tempfile.TemporaryDirectory(prefix="obscura-page-") as temporary, browser.Browser() as window:
        picture(window, pathlib.Path(temporary))
    sys.exit(0)
with tempfile.TemporaryDirectory(prefix="obscura-page-") as temporary, browser.Browser() as window:
    folder = pathlib.Path(temporary)
    camera = SmallDaemon(folder, obscurad, source, name="camera <1> &amp.toml",  # names are texts in the page
                         tables=f'[control]\nunix_socket = "{folder}/calls"\n')
    path = camera.socket
    daemon = camera.start()
    server = Child([web, "--listen", "127.0.0.1:0", "--role", "operator", "--socket", path], stdout=subprocess.PIPE, text=True)
    link = server.stdout.readline().strip()

    def state():
        answer = subprocess.run([obscura, "status", "--json", "--socket", path], capture_output=True, text=True)
        cameras = json.loads(answer.stdout)["cameras"] if answer.stdout else []
        return cameras[0] if cameras else None

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
    check("the latest frames are plotted, with their figures", window.wait_for("document.querySelectorAll('.timeplot').length === 2 && document.querySelectorAll('section[aria-labelledby=t-stages] tbody tr').length >= 6"))
    verdict = window.text("#verdict")
    check("it shows the verdict", re.search(r"last \d+ s$", verdict), verdict)
    go(window, "transports")
    rows = rows_of(window, "Files, place")
    check("it shows where frames go", rows["folder"] == after["transports"]["file"]["directory"] and re.match(r"[\d.]+ [GM]iB$", rows["free on its disk"].replace("\u202f", "")), rows)
    check("and that nobody can control the camera", after["address"] == "none" and "no GigE Vision" in window.text("main"))
    go(window, "system")
    window.wait_for("document.querySelectorAll('#log tbody tr').length > 2")
    check("the log is there", "starting with" in window.text("#log"))
    check("a name with markup is text", rows_of(window, "Daemon")["configuration"].endswith("camera <1> &amp.toml"), rows_of(window, "Daemon"))
    rate = next(k for k, line in enumerate(camera.config.read_text().splitlines(), 1) if line.startswith("rate_hz"))
    found = window.wait_for("[...document.querySelectorAll('section[aria-labelledby=y-configuration] tbody tr')].find((r) => r.firstChild.textContent === 'trigger.rate_hz')?.textContent")
    check("a key stands there with value, unit, file and line", re.fullmatch(rf"trigger\.rate_hz10(\.0)?Hz.*camera <1> &amp\.toml:{rate}", str(found)), found)
    live_screen(window, Api(link))
    # That this test looks at the canvas is no fault of the page.
    # Faults need GigE Vision, which this camera does not have: the daemon says so, and the browser lists that.
    complaints = [c for c in window.complaints if "willReadFrequently" not in c and not c.endswith("/faults")]
    check("the browser complains of nothing", complaints == [], complaints)
    for theme in "dark", "light":
        window.prefer(theme)
        for width in 1280, 1920:
            window.resize(width, 1080)
            window.open("about:blank")
            window.open(link)
            there(window, "live")
            drawn(window)
            window.screenshot(output / f"page-{theme}-{width}.png")
    window.resize(1280, 900)
    window.open("about:blank")
    window.open(link.split("token=")[0] + "token=wrong")
    check("with a wrong token it says what to do, and shows nothing", window.wait_for("document.querySelector('#verdict')?.textContent.includes('This token is not known')") and not window.text("main"))
    window.open("about:blank")
    window.open(link)
    window.wait_for("document.querySelector('#verdict')?.textContent.includes('last')")
    daemon.send_signal(signal.SIGKILL)
    daemon.wait()
    check("without the daemon it says so", window.wait_for("document.querySelector('#verdict').textContent.includes('The camera has gone') && document.querySelector('main').textContent.includes('journalctl')"), window.text("#verdict"))
    server.terminate()
    server.wait(PATIENCE_S)
sys.exit(1 if failures else 0)
