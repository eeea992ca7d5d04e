#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The screens of the page in a browser, before a stand-in whose frames are known: pixels, probe, region, commands, roles, keyboard.

Usage: page_screens_test.py SOURCE-DIRECTORY OUTPUT-FOLDER
Leaves pictures of all screens in the folder, to be looked at. Exit status 77 without Chromium (Debian package chromium), 1 if a check
failed.
"""
import base64
import gzip
import json
import math
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import browser  # noqa: E402
from page_double import BITS, BLACK_DN, CAMERA, GAIN_DN_PER_E, HEIGHT, WIDTH, PageDouble, reduced  # noqa: E402

page, output = pathlib.Path(sys.argv[1]) / "web/page", pathlib.Path(sys.argv[2])
MOST_KB = 90
SCREENS = ["live", "timing", "camera", "scene", "faults", "transports", "system"]
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)[:2000]}", flush=True)
    if not good:
        failures.append(what)


def end():
    sys.exit(1 if failures else 0)


def quantile(pixels, share):
    return sorted(pixels)[int(share * (len(pixels) - 1))]


def levels(kind, pixels, manual=None):
    """Grey of each pixel by the formulas of `--stretch` (docs of the command line), 0 to 255."""
    black, white = {"linear": lambda: (0, 2**BITS - 1), "percentile": lambda: (quantile(pixels, 0.005), quantile(pixels, 0.995)), "manual": lambda: manual}.get(
        kind, lambda: (quantile(pixels, 0.05), quantile(pixels, 0.9999)))()
    tone = {"auto": lambda x: 0.8 * x ** (1 / 2.2) + 0.2 * math.asinh(x / 1e-3) / math.asinh(1e3), "asinh": lambda x: math.asinh(x / 0.01) / math.asinh(100),
            "log": lambda x: math.log1p(1000 * x) / math.log1p(1000)}.get(kind, lambda x: x)
    table = {dn: math.floor(255 * (tone(x) if (x := min(1, max(0, (dn - black) / (white - black)))) > 0 else 0) + 0.5) for dn in set(pixels)}
    return bytes(table[dn] for dn in pixels)


weight = {str(file.relative_to(page)): len(gzip.compress(file.read_bytes(), 9)) for file in page.rglob("*") if file.suffix in (".html", ".js", ".css", ".svg")}
check(f"the page has no more than {MOST_KB} kB on the wire", sum(weight.values()) <= MOST_KB * 1000, weight)
print(f"{sum(weight.values())} bytes compressed")
if browser.missing():
    print(f"skipped: {browser.missing()}")
    sys.exit(1 if failures else 77)
output.mkdir(parents=True, exist_ok=True)


def go(window, screen):
    window.evaluate(f"location.hash = '{screen}'")
    window.wait_for(f"document.querySelector('nav a[aria-current]')?.getAttribute('href') === '#{screen}'")


def press_button(window, words, nth=0):
    """Clicks the button with exactly that text."""
    script = f"[...document.querySelectorAll('button')].filter((b) => b.textContent.trim() === {json.dumps(words)} && !b.disabled)[{nth}]"
    found = window.wait_for(f"!!({script})", 20)
    check(f"there is a button {words}", found)
    if found:
        window.evaluate(f"({script}).click()")


def choose(window, selector, value):
    window.evaluate(f"(() => {{ const e = document.querySelector({json.dumps(selector)}); e.value = {json.dumps(value)}; e.dispatchEvent(new Event('change', {{bubbles: true}})); }})()")


def rows_of(window, label):
    """Names and values of a table of facts."""
    return dict(window.evaluate(f"[...document.querySelectorAll('table[aria-label={json.dumps(label)}] tr')].map((r) => [...r.children].map((c) => c.textContent.replaceAll('\\u202f', '')))"))


def canvas_greys(window):
    """Grey of what the canvas shows of the image: (width, height, bytes)."""
    told = window.evaluate("""(() => { const c = document.querySelector('.stage canvas'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
      let x0 = c.width, y0 = c.height, x1 = -1, y1 = -1;
      for (let y = 0; y < c.height; ++y) for (let x = 0; x < c.width; ++x) if (d[4 * (y * c.width + x) + 3]) { x0 = Math.min(x0, x); x1 = Math.max(x1, x); y0 = Math.min(y0, y); y1 = Math.max(y1, y); }
      let text = ""; for (let y = y0; y <= y1; ++y) for (let x = x0; x <= x1; ++x) text += String.fromCharCode(d[4 * (y * c.width + x)]);
      return [x1 - x0 + 1, y1 - y0 + 1, btoa(text)]; })()""")
    return told[0], told[1], base64.b64decode(told[2])


def place_of(window):
    return window.evaluate("(() => { const b = document.querySelector('.stage canvas').getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()")


def probe_at(window, x, y):
    """What the probe shows for a position on the screen: ((column, row), DN)."""
    window.mouse("Moved", x, y)
    window.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    told = rows_of(window, "Probe")
    return tuple(int(n) for n in told["x, y"].split(",")), told["DN"]


def live_screen(window, double):
    go(window, "live")
    check("a picture comes", window.wait_for("document.querySelector('table[aria-label=Frame]')", 60))
    press_button(window, "1:1")
    window.wait_for("document.querySelector('.scale').textContent === '100 %'", 20)
    window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('single pixels')", 20)
    double.runs = False
    for kind in "auto", "linear", "percentile", "asinh", "log":
        choose(window, ".panel select", kind)
        time.sleep(0.3)
        width, height, greys = canvas_greys(window)
        wanted = levels(kind, double.pixels)
        check(f"the canvas has the pixels of the frame, {kind}", (width, height) == (WIDTH, HEIGHT) and greys == wanted,
              f"{width} x {height}, {sum(a != b for a, b in zip(greys, wanted))} differ")
    window.evaluate("(() => { for (const [k, v] of [[0, 60], [1, 300]]) { const e = document.querySelectorAll('.row input[type=number]')[k]; e.value = v; e.dispatchEvent(new Event('change', {bubbles: true})); } })()")
    time.sleep(0.3)
    first = window.evaluate("[...document.querySelectorAll('.row input[type=number]')].map((e) => Number(e.value))")
    check("levels typed are manual ones", first[1] == 300 and window.evaluate("document.querySelector('.panel select').value") == "manual", first)
    check("the canvas has the pixels of the frame, manual", canvas_greys(window)[2] == levels("manual", double.pixels, first))
    choose(window, ".panel select", "auto")

    left, top, width, height = place_of(window)
    origin = left + (width - WIDTH) // 2, top + (height - HEIGHT) // 2
    for at in range(25):
        x, y = (37 * at + 11) % WIDTH, (59 * at + 400) % HEIGHT
        (px, py), dn = probe_at(window, origin[0] + x + 0.5, origin[1] + y + 0.5)
        if (px, py) != (x, y) or dn != str(double.pixels[y * WIDTH + x]):
            check(f"the probe at {x}, {y} shows the pixel's DN", False, f"{px}, {py}: {dn}, wanted {double.pixels[y * WIDTH + x]}")
            break
    else:
        check("the probe shows the DN of 25 pixels", True)
    (px, py), dn = probe_at(window, origin[0] + 300.5, origin[1] + 250.5)
    electrons = float(window.text("#probe-electrons").replace("\u202f", ""))
    check("electrons are those of the linear model", abs(electrons - (int(dn) - BLACK_DN) / GAIN_DN_PER_E) <= 0.51, electrons)
    for _ in range(6):
        window.mouse("Wheel", origin[0] + 300.5, origin[1] + 250.5, deltaX=0, deltaY=-120)
    check("the wheel zooms", window.wait_for("parseFloat(document.querySelector('.scale').textContent) > 300", 20))
    window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('single pixels')", 20)
    before, dn = probe_at(window, origin[0] + 300.5, origin[1] + 250.5)
    check("the probe shows the pixel's DN there too", dn == str(double.pixels[before[1] * WIDTH + before[0]]), (before, dn))
    window.mouse("Wheel", origin[0] + 300.5, origin[1] + 250.5, deltaX=0, deltaY=-120)
    after, _ = probe_at(window, origin[0] + 300.5, origin[1] + 250.5)
    check("the pixel at the pointer stays there", max(abs(a - b) for a, b in zip(before, after)) <= 1, (before, after))
    told = rows_of(window, "Digital numbers")
    check("the saturated pixels are those of the whole frame", told["saturated pixels"] == str(double.histogram["saturated"]), told)
    check("the bodies are listed", window.evaluate("[...document.querySelectorAll('details.panel')].some((d) => /^Bodies in frame.*asteroid/.test(d.textContent))"))
    press_button(window, "fit")
    time.sleep(0.3)
    circle = window.evaluate("(() => { const c = document.querySelector('.overlay circle'); return ['cx', 'cy', 'r'].map((n) => Number(c.getAttribute(n))); })()")
    scale = min(width / WIDTH, height / HEIGHT)
    body = double.truth()["bodies"][0]
    wanted = [(body["x"] + 0.5 - WIDTH / 2) * scale + width / 2, (body["y"] + 0.5 - HEIGHT / 2) * scale + height / 2, body["radius_px"] * scale]
    check("the limb is where the truth says", all(abs(a - b) < 1.5 for a, b in zip(circle, wanted)), (circle, wanted))

    # A window too small for single pixels: blocks, by their largest or mean.
    window.resize(700, 400)
    window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('of 2 x 2')", 20)
    double.beat()
    for reduce, words in ("max", "largest"), ("mean", "mean"):
        choose(window, ".toolbar select", reduce)
        double.beat()
        window.wait_for(f"document.querySelector('table[aria-label=Frame]').textContent.includes('{words} of')", 20)
        time.sleep(0.3)
        left, top, width, height = place_of(window)
        (px, py), dn = probe_at(window, left + width / 2 - 20.3, top + height / 2 + 30.3)
        bin = int(rows_of(window, "Frame")["shown as"].split()[-1])
        block = reduced(double.pixels, px // bin * bin, py // bin * bin, bin, bin, bin, reduce)[0]
        check(f"binned, the probe shows the {words} of the block, and says so", dn == str(block) and f"{words} of {bin} x {bin}" in window.text(".probe-panel"), (px, py, dn, block))
    window.resize(1280, 900)
    window.wait_for("innerWidth === 1280 && document.querySelector('.stage canvas').width === document.querySelector('.stage').clientWidth && document.querySelector('.stage').clientWidth === 878", 20)
    double.runs = True


def region(window, double):
    press_button(window, "1:1")
    window.wait_for("document.querySelector('.scale').textContent === '100 %'", 20)
    window.evaluate("document.querySelector('.stage canvas').focus()")
    window.press("r")
    left, top, width, height = place_of(window)
    origin = left + (width - WIDTH) // 2, top + (height - HEIGHT) // 2
    window.wait_for("document.querySelector('.stage.drawing')", 20)
    check("the picture is 1:1", canvas_greys(window)[:2] == (WIDTH, HEIGHT), canvas_greys(window)[:2])
    window.mouse("Pressed", origin[0] + 101.5, origin[1] + 51.5, button="left", clickCount=1)
    for x, y in (150, 100), (250, 150), (303, 203):
        window.mouse("Moved", origin[0] + x + 0.5, origin[1] + y + 0.5, button="left", buttons=1)
    window.mouse("Released", origin[0] + 303.5, origin[1] + 203.5, button="left", clickCount=1)
    shown = window.wait_for("(() => { const q = [...document.querySelectorAll('.quad input')].map((e) => e.value).join(); return q === '640,512,0,0' ? '' : q; })()", 20)
    print("region", shown)
    double.asked.clear()
    press_button(window, "stop, set, start")
    check("the region is set", window.wait_for("document.querySelector('.side').textContent.includes('Set: ')", 60))
    wanted = {"Width": 204, "Height": 154, "OffsetX": 100, "OffsetY": 50}  # 101.5 to 303.5 and 51.5 to 203.5 in steps of 4 and 2
    check("the acquisition stops, the region in whole increments is set, and it starts again",
          [(m, p.rsplit("/", 1)[1], b) for m, p, b in double.asked] == [("POST", "acquisition", {"running": False}), ("PATCH", "features", wanted), ("POST", "acquisition", {"running": True})], double.asked)
    check("the picture has the region's size", window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('204 x 154')", 60))
    window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('single pixels')", 20)
    press_button(window, "1:1")
    time.sleep(0.5)
    part = reduced(double.pixels, 100, 50, 204, 154, 1, "max")
    check("the canvas has the region's pixels", canvas_greys(window) == (204, 154, levels("auto", part)))
    press_button(window, "whole sensor")
    check("the whole sensor returns", window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('640 x 512')", 60))


def saving(window, double):
    folder = pathlib.Path(window.downloads.name)
    press_button(window, "newest, FITS")
    window.wait_for("document.querySelector('.side').textContent.includes('Saved frame')", 60)
    limit = time.monotonic() + 60
    while time.monotonic() < limit and not list(folder.glob("frame_*.fits")):
        time.sleep(0.1)
    files = list(folder.glob("frame_*.fits"))
    check("the newest frame is saved as the server gave it", len(files) == 1 and files[0].read_bytes() == double.pixels.tobytes(), list(folder.iterdir()))


def other_screens(window, double):
    go(window, "timing")
    check("timing: a plot of the stages with its table", window.wait_for("document.querySelectorAll('.timeplot').length === 2 && document.querySelectorAll('.screen .grid tbody tr').length > 10", 60))
    missed = rows_of(window, "Missed triggers by reason")
    check("timing: missed triggers by reason", missed == {"lost edge": "0", "chip busy": "2", "rendering": "1", "latch full": "0", "stopped": "0"}, missed)
    worst = max(double.timing, key=lambda row: row[14])
    first = window.evaluate("[...document.querySelector('section[aria-labelledby=t-worst] tbody tr').children].map((c) => c.textContent)")
    check("timing: the worst frame stands first, with what was wrong", first[0] in [str(r[0]) for r in double.timing if r[14] == worst[14]] and "late rows" in first[-1], first)
    check("timing: histograms describe themselves", window.evaluate("[...document.querySelectorAll('.histogram svg')].every((s) => /median/.test(s.getAttribute('aria-label')))"))
    go(window, "camera")
    window.wait_for("document.querySelector('#f-Gain')", 60)
    shown = window.evaluate("Object.fromEntries([...document.querySelectorAll('.features tbody tr')].map((r) => [r.children[0].textContent, [r.querySelector('input,select').type === 'checkbox'"
                            " ? r.querySelector('input').checked : r.querySelector('input,select').value, r.querySelector('input,select').disabled, r.children[2].textContent]]))")
    wanted = {n: [r["value"] if isinstance(r["value"], bool) else f"{r['value']:g}" if isinstance(r["value"], float) else str(r["value"]), r["locked"], r.get("unit", "")] for n, r in double.features.items()}
    check("camera: every feature with value, unit and lock", shown == wanted, {n: (shown.get(n), wanted[n]) for n in wanted if shown.get(n) != wanted[n]})
    double.asked.clear()
    window.click_on("#f-Gain")
    window.evaluate("document.querySelector('#f-Gain').select()")
    window.write("6.5")
    window.press("Enter")
    check("camera: a typed value is set by Enter, and the answer is shown", window.wait_for("document.querySelector('form .said').textContent.includes('Gain = 6.5')", 60))
    check("camera: only what was edited is sent", double.asked == [("PATCH", f"/api/v1/cameras/{CAMERA}/features", {"Gain": 6.5})], double.asked)
    press_button(window, "software trigger")
    check("camera: a refusal is shown in the daemon's words", window.wait_for("document.querySelector('.said.bad')?.textContent.includes('not On and Software')", 60))
    press_button(window, "stop")
    check("camera: stopped, the verdict says so", window.wait_for("document.querySelector('#verdict').textContent.includes('idle')", 60))
    press_button(window, "start")
    window.wait_for("document.querySelector('#verdict').textContent.includes('on time')", 60)
    go(window, "scene")
    window.wait_for("document.querySelector('form select')", 60)
    choose(window, "form select", "moon")
    press_button(window, "show")
    check("scene: another one is shown", window.wait_for("document.querySelector('table[aria-label=Scene]').textContent.includes('moon')", 60) and double.shown == "moon")
    go(window, "faults")
    press_button(window, "every 10th frame skipped")
    check("faults: a template arms a rule", window.wait_for("document.querySelector('.bad-item')?.textContent.includes('1 ARMED')", 60) and double.rules == [{"kind": "skip_frame", "every": 10}], double.rules)
    check("faults: the table says how often it has struck", window.wait_for("document.querySelector('.grid tbody tr')?.textContent.includes('skip frameevery 10an operator7')", 60))
    press_button(window, "disarm all")
    check("faults: all are disarmed", window.wait_for("document.querySelector('.items').textContent.includes('faultsnone')", 60) and double.rules == [])
    go(window, "transports")
    window.wait_for("document.querySelector('table[aria-label=\"GigE Vision\"]')")
    told = rows_of(window, "GigE Vision")
    check("transports: counters are the daemon's", told.get("resend requests") == "4", told)
    go(window, "system")
    window.wait_for("document.querySelectorAll('#log tbody tr').length === 5", 60)
    check("system: the log, newest first, markup as text", window.evaluate("document.querySelector('#log tbody tr:last-child').textContent").endswith("/etc/obscura/<moon> &amp.toml"))
    check("system: keys with where they come from, without defaults", window.wait_for("document.querySelector('section[aria-labelledby=y-configuration] tbody')?.textContent.includes('trigger.rate_hz5Hz--set')", 60)
          and not window.evaluate("document.querySelector('section[aria-labelledby=y-configuration]').textContent.includes('late_policy')"))
    check("system: what was changed is listed", window.wait_for("document.querySelector('section[aria-labelledby=y-audit] tbody')?.textContent.includes('skip_frame')", 60))


def by_keyboard(window):
    """Digits reach the screens; on each the tabulator reaches every control, all of which have names."""
    window.evaluate("document.activeElement.blur()")
    for number, screen in enumerate(SCREENS):
        window.press(str(number + 1))
        check(f"key {number + 1}: {screen}", window.wait_for(f"location.hash === '#{screen}'", 20))
        time.sleep(1)
        window.evaluate("window.all = [...document.querySelectorAll('a[href], button, select, input, summary, [tabindex]')].filter((e) => !e.disabled && e.getClientRects().length); window.reached = new Set(); document.activeElement.blur()")
        for _ in range(window.evaluate("all.length") + 3):
            window.press("Tab")
            window.evaluate("reached.add(document.activeElement)")
        missed = window.evaluate("all.filter((e) => e.isConnected && !e.disabled && !reached.has(e)).map((e) => e.outerHTML.slice(0, 80))")
        check(f"{screen}: the tabulator reaches everything", missed == [], missed)
        nameless = window.evaluate("[...document.querySelectorAll('button, select, input, a[href]')].filter((e) => !(e.textContent.trim() && e.tagName !== 'SELECT') && !e.ariaLabel && !e.labels?.length).map((e) => e.outerHTML)")
        check(f"{screen}: every control has a name", nameless == [], nameless)
        images = window.evaluate("[...document.querySelectorAll('svg, canvas')].filter((e) => !e.ariaLabel && e.ariaHidden !== 'true').map((e) => e.outerHTML.slice(0, 80))")
        check(f"{screen}: every picture is described, or left out", images == [], images)
        window.evaluate("document.activeElement.blur()")


def refusals(window, double):
    double.refuse = {"/features": (503, "this daemon takes no calls: set control.unix_socket"), "/timing": (404, "the paths are: / /livez"), "/audit": (403, "the role admin is wanted")}
    window.open("about:blank")
    window.open(double.link)
    go(window, "camera")
    check("without calls the screen says which key to set", window.wait_for("document.querySelector('.note')?.textContent.includes('set control.unix_socket')", 60))
    go(window, "timing")
    check("an older server is named", window.wait_for("document.querySelector('.screen').textContent.includes('a later version')", 60))
    go(window, "system")
    check("what the role may not see is not there", window.wait_for("document.querySelector('#y-log') && !document.querySelector('#y-audit')", 60))
    double.refuse, double.controller = {}, "192.168.1.20:50211"
    go(window, "camera")
    window.wait_for("document.querySelector('#f-Gain')", 60)
    window.click_on("#f-Gain")
    window.evaluate("document.querySelector('#f-Gain').select()")
    window.write("3")
    window.press("Enter")
    check("a camera that another controls is not changed, and the page says by whom", window.wait_for("document.querySelector('.said.bad')?.textContent.includes('controlled by 192.168.1.20:50211')", 60))
    double.controller, double.role = "", "viewer"
    window.open("about:blank")
    window.open(double.link)
    for screen, word in ("camera", "start"), ("faults", "disarm all"), ("scene", "show"):
        go(window, screen)
        window.wait_for("document.querySelector('.items')?.textContent.includes('viewer')", 60)
        time.sleep(0.5)
        check(f"a viewer has no button {word}", not window.evaluate(f"[...document.querySelectorAll('button')].some((b) => b.textContent === '{word}')"))
    window.open("about:blank")
    window.open(double.link.replace("known", "wrong"))
    check("a wrong token: the page says what to do", window.wait_for("document.querySelector('#verdict')?.textContent.includes('This token is not known')", 60))
    asked = window.evaluate("performance.getEntriesByType('resource').filter((e) => e.name.includes('/api/')).length")
    time.sleep(1.5)
    check("and does not go on trying it", window.evaluate("performance.getEntriesByType('resource').filter((e) => e.name.includes('/api/')).length") == asked)


def pictures(window, double):
    double.role = "operator"
    double.rules = [{"kind": "lose", "percent": 1}]
    for theme in "dark", "light", "red":
        for width, height in (1280, 900), (1920, 1080):
            if theme == "red" and width == 1920:
                continue
            window.resize(width, height)
            window.open("about:blank")
            window.open(double.link)
            choose(window, "#theme", theme)
            for screen in SCREENS:
                go(window, screen)
                time.sleep(1.2)
                if screen == "live":
                    window.mouse("Moved", 420, 480)
                    time.sleep(0.3)
                window.screenshot(output / f"{screen}-{theme}-{width}.png")
                wide = window.evaluate("document.documentElement.scrollWidth > innerWidth")
                check(f"{screen}, {theme}, {width}: nothing is cut off at the side", not wide)


double = PageDouble(page)
with browser.Browser() as window:
    window.open(double.link)
    live_screen(window, double)
    region(window, double)
    saving(window, double)
    other_screens(window, double)
    by_keyboard(window)
    # That this test looks at the canvas is no fault of the page.
    window.complaints = [c for c in window.complaints if "willReadFrequently" not in c]
    expected = [c for c in window.complaints if "status of 409" in c]
    check("the browser complains of nothing but the refusal that was asked for", window.complaints == expected and len(expected) == 1, window.complaints)
    window.complaints.clear()
    refusals(window, double)
    check("after refusals too", all("Failed to load resource" in c for c in window.complaints), window.complaints)
    window.complaints.clear()
    pictures(window, double)
    check("nor while screens change", window.complaints == [], window.complaints)
double.close()
end()
