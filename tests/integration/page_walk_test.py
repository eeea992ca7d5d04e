#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""All screens of the page of a running camera, by keyboard alone: every control is reached and shows that it has the focus, Enter and arrow
keys do what clicks do, the browser complains of nothing, nothing violates the content security policy, and those who see little or nothing
are not left out, in three themes.

Usage: page_walk_test.py OBSCURAD OBSCURA-WEB SOURCE-DIRECTORY OUTPUT-FOLDER [--firefox] [--axe FILE]
--firefox: in Firefox (Debian package firefox-esr) instead of Chromium; without a window it does not take the focus, so that what shows it
and what keys do is checked in Chromium only. --axe: the script of axe-core, whose serious findings count, too.
Leaves what it saw in the folder. Exit status 77 without the browser, 1 if a check failed.
"""
import argparse
import atexit
import json
import os
import pathlib
import sys
import tempfile
import time

SUPPORT = pathlib.Path(__file__).resolve().parents[1] / "support"
sys.path.insert(0, str(SUPPORT))
import browser  # noqa: E402
import firefox  # noqa: E402
from page_view import drawn, there  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402
from web_server import Web  # noqa: E402

arguments = argparse.ArgumentParser()
for name in "obscurad", "web", "source", "output":
    arguments.add_argument(name)
arguments.add_argument("--firefox", action="store_true")
arguments.add_argument("--axe", type=pathlib.Path)
options = arguments.parse_args()
driver, make_window = (firefox, firefox.Firefox) if options.firefox else (browser, browser.Browser)
SCREENS = ["live", "timing", "camera", "scene", "faults", "transports", "system", "models"]
FOCUSABLE = "a[href], button, select, input, textarea, summary, [tabindex]"
failures, processes = [], []
atexit.register(lambda: [process.kill() for process in processes])


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)[:3000]}", flush=True)
    if not good:
        failures.append(what)


def settled(window, screen):
    """Waits until the screen has what it asks for, and has drawn it."""
    check(f"{screen}: it has all that it shows", there(window, screen))
    drawn(window)


def walk(window, screen):
    """Presses the tabulator once around, from the top: where no window can take it, Firefox comes back to the last control. Elements that
    come and go meanwhile do not count."""
    window.evaluate(f"(window.all = [...document.querySelectorAll('{FOCUSABLE}')].filter((e) => !e.disabled && e.tabIndex >= 0 && e.getClientRects().length && e.checkVisibility()), window.reached = new Set(), window.unseen = [], document.body.tabIndex = -1, document.body.focus(), document.body.removeAttribute('tabindex'), all.length)")
    missing = "all.filter((e) => e.isConnected && !e.disabled && !reached.has(e) && !(e.type === 'radio' && [...reached].some((r) => r.name === e.name)))"  # arrow keys move within a group
    for turn in range(2 * window.evaluate("all.length") + 20):
        if turn % 20 == 19 and window.evaluate(f"{missing}.length") == 0:
            break
        window.press("Tab")
        window.evaluate("""(() => { const e = document.activeElement, s = getComputedStyle(e); reached.add(e);
          if (e !== document.body && !(s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 1)) unseen.push(e.outerHTML.slice(0, 100)); return 0; })()""")
    missed = window.evaluate(f"{missing}.map((e) => e.outerHTML.slice(0, 100))")
    check(f"{screen}: the tabulator reaches all of {window.evaluate('all.length')} controls", missed == [], missed)
    if not options.firefox:
        unseen = window.evaluate("unseen")
        check(f"{screen}: what has the focus shows it", unseen == [], unseen)
    window.evaluate("document.activeElement?.blur()")


def axe_findings(window):
    return window.evaluate("axe.run().then((r) => r.violations.filter((v) => ['serious', 'critical'].includes(v.impact)).map((v) => [v.id, v.nodes.slice(0, 3).map((n) => n.html.slice(0, 160))]))")


def accessible(window):
    """The rules of accessibility.js on each screen in each theme."""
    rules = (SUPPORT / "accessibility.js").read_text().split("\n", 3)[3]
    if options.axe:
        window.evaluate(f"(() => {{ {options.axe.read_text()}; return 0; }})()")
    for theme in "dark", "light", "red":
        window.evaluate(f"(() => {{ const e = document.querySelector('#theme'); e.value = '{theme}'; e.dispatchEvent(new Event('change', {{bubbles: true}})); return 0; }})()")
        for screen in SCREENS:
            window.evaluate(f"(location.hash = '{screen}', 0)")
            settled(window, screen)
            found = window.evaluate(rules) + (axe_findings(window) if options.axe else [])
            check(f"{screen}, {theme}: nothing keeps anybody out", found == [], found)
            if theme == "dark":
                window.screenshot(pathlib.Path(options.output) / f"walk-{screen}-{'firefox' if options.firefox else 'chromium'}.png")


def by_keys(window, server, camera):
    """Commands of an operator without a mouse."""
    def ask(path):
        return json.loads(server.ask(f"/api/v1/cameras/{camera}/{path}").text)

    def number(selector):
        return float("".join(c for c in window.text(selector) or "" if c in "0123456789.") or 0)

    window.evaluate("document.activeElement?.blur()")
    check("the tabulator comes to the screens", window.tab_to("nav a[href='#timing']"))
    window.press("Enter")
    check("Enter opens one", window.wait_for("location.hash === '#timing'"))
    window.press("1")
    settled(window, "live")
    window.wait_for("document.querySelector('table[aria-label=Frame]')")
    check("the tabulator comes to the picture", window.tab_to(".stage canvas"))
    window.press("ArrowRight")
    where = "document.querySelector('table[aria-label=Probe] td')?.textContent"
    first = window.wait_for(where)
    window.press("ArrowRight")
    window.press("ArrowDown")
    x, y = (int(n) for n in first.split(","))
    check("arrow keys move the probe", window.wait_for(f"{where}.replace(' ', '') === '{x + 1},{y + 1}'"), (first, window.evaluate(where)))
    scale = number(".scale")
    window.press("+")
    check("plus zooms", window.wait_for(f"parseFloat(document.querySelector('.scale').textContent) > {scale}"), scale)
    check("the tabulator comes to the themes", window.tab_to("#theme"))
    theme = window.evaluate("document.documentElement.dataset.theme")
    window.press("ArrowDown")
    check("arrow keys choose one", window.wait_for(f"document.documentElement.dataset.theme !== '{theme}'"))
    window.evaluate("document.activeElement.blur()")
    window.press("3")
    settled(window, "camera")
    check("the tabulator comes to a feature", window.tab_to("#f-Gain"))
    window.evaluate("document.activeElement.select()")
    window.write("6.5")
    window.press("Enter")
    check("Enter sets it", window.wait_for("document.querySelector('form .said')?.textContent.includes('Gain = 6.5')"), window.text("form .said"))
    check("the camera has the value", [row["value"] for row in ask("features")["features"] if row["name"] == "Gain"] == [6.5])
    window.evaluate("document.activeElement.blur()")
    window.press("5")
    settled(window, "faults")
    check("the tabulator comes to a template of a fault", window.evaluate("([...document.querySelectorAll('main button')].find((b) => /skipped/.test(b.textContent)) ?? document.body).id = 'walked', true") and window.tab_to("#walked"))
    window.press("Enter")
    armed = window.wait_for("document.querySelector('.items').textContent.includes('ARMED')")
    check("Enter arms it", armed and len(ask("faults")["rules"]) == 1, ask("faults")["rules"])
    window.evaluate("([...document.querySelectorAll('main button')].find((b) => b.textContent.trim() === 'disarm all') ?? document.body).id = 'walked-2'")
    check("the tabulator comes to what disarms all", window.tab_to("#walked-2"))
    window.press(" ")
    disarmed = window.wait_for("!document.querySelector('.items').textContent.includes('ARMED')")
    check("and the space bar does it", disarmed and ask("faults")["rules"] == [], ask("faults")["rules"])
    window.evaluate("document.activeElement.blur()")


def frame_is_shown(window, server, camera):
    """A pixel of the canvas, by the probe, and all of the canvas not of one grey."""
    window.press("1")
    settled(window, "live")
    window.wait_for("document.querySelector('table[aria-label=Frame]')")
    server.ask(f"/api/v1/cameras/{camera}/features", "PATCH", body={"TriggerSource": "Software", "ExposureTime": 500})
    for _ in range(20):  # a frame of the timer may still be in progress
        told = json.loads(server.ask(f"/api/v1/cameras/{camera}/trigger", "POST", body={}).text)
        if told.get("outcome") == "complete" or told.get("outcome") == "late":
            break
    check("the page shows the frame that was triggered", window.wait_for(f"document.querySelector('table[aria-label=Frame] td').textContent === '{told.get('frame')}'"), told)
    pixels = memoryview(server.ask(f"/api/v1/cameras/{camera}/frames/latest.raw").content).cast("H").tolist()
    window.tab_to(".stage canvas")
    window.press("o")
    window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('single pixels')")
    wrong, width = [], json.loads(server.ask(f"/api/v1/cameras/{camera}/frames/latest.json").text)["width"]
    for key in ["ArrowRight"] * 6 + ["ArrowDown"] * 6 + ["ArrowLeft"] * 3:
        window.press(key)
        window.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))")
        at, dn = window.evaluate("[...document.querySelectorAll('table[aria-label=Probe] td')].slice(0, 2).map((c) => c.textContent.replaceAll('\\u202f', ''))")
        x, y = (int(n) for n in at.split(","))
        if dn != str(pixels[y * width + x]):
            wrong.append((x, y, dn, pixels[y * width + x]))
    check("the probe shows the numbers of the frame", wrong == [] and len(set(pixels)) > 20, wrong)
    greys = window.evaluate("(() => { const c = document.querySelector('.stage canvas'); return new Set(c.getContext('2d').getImageData(0, 0, c.width, c.height).data).size; })()")
    check("the picture is drawn", greys > 20, greys)


if driver.missing():
    print(f"skipped: {driver.missing()}")
    sys.exit(77)
pathlib.Path(options.output).mkdir(parents=True, exist_ok=True)
with tempfile.TemporaryDirectory(prefix="obscura-walk-") as folder, make_window() as window:
    pid = os.getpid()
    small = SmallDaemon(folder, options.obscurad, options.source, rate_hz=5, gige=f'interface = "127.{64 + (pid >> 14 & 63)}.{pid >> 6 & 255}.{(pid & 63) * 4 + 2}"',
                        tables=f'[control]\nunix_socket = "{folder}/calls"\n[daemon]\nautostart = true\n')
    daemon = small.start()
    processes.append(daemon)
    server = Web(options.web, "--role", "operator", "--socket", small.socket)
    processes.append(server.process)
    end = time.monotonic() + driver.PATIENCE_S
    while not json.loads(server.ask("/api/v1/state").text)["daemons"] and time.monotonic() < end:
        time.sleep(0.1)
    window.open(server.link)
    settled(window, "live")  # a page that has not begun takes no keys
    for number, screen in enumerate(SCREENS):
        window.press(str(number + 1))
        check(f"key {number + 1}: {screen}", window.wait_for(f"location.hash === '#{screen}'"))
        settled(window, screen)
        walk(window, screen)
    if not options.firefox:
        by_keys(window, server, f"{daemon.pid}-0")
    accessible(window)
    frame_is_shown(window, server, f"{daemon.pid}-0")
    # That this test looks at the canvas is no fault of the page.
    complaints = [line for line in window.complaints if "willReadFrequently" not in line]
    check("the browser complains of nothing", complaints == [], complaints)
    check("nothing violates the security policy", window.violations() == [], window.violations())
    window.evaluate("(document.body.append(Object.assign(document.createElement('style'), {textContent: 'p {color: red}'})), 0)")
    check("which would have been seen", window.wait_for("window.violations.length === 1"), window.violations())
    window.evaluate("(document.querySelector('#theme').removeAttribute('id'), document.querySelector('main').append(document.createElement('button')), 0)")
    rules = (SUPPORT / "accessibility.js").read_text().split("\n", 3)[3]
    check("as would have been a control without a name", any(rule == "what can be used or seen has a name" for rule, _ in window.evaluate(rules)))
sys.exit(1 if failures else 0)
