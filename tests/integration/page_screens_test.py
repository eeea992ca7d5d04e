#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The screens of the page in a browser, before a stand-in whose frames are known: pixels, probe, region, commands, roles, keyboard.

Usage: page_screens_test.py SOURCE-DIRECTORY OUTPUT-FOLDER
Leaves pictures of all screens in the folder, to be looked at. Exit status 77 without Chromium (Debian package chromium), 1 if a check
failed.
"""
import base64
import json
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import browser  # noqa: E402
from checks import until  # noqa: E402
from page_double import BITS, BLACK_DN, CAMERA, GAIN_DN_PER_E, HEIGHT, WIDTH, PageDouble, reduced  # noqa: E402
from page_view import begun, canvas_greys, choose, drawn, go, place_of, rows_of, there  # noqa: E402
from page_view import press_button as press  # noqa: E402

page, output = pathlib.Path(sys.argv[1]) / "web/page", pathlib.Path(sys.argv[2])
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


if browser.missing():
    print(f"skipped: {browser.missing()}")
    sys.exit(77)
output.mkdir(parents=True, exist_ok=True)


def press_button(window, words):
    check(f"there is a button {words}", press(window, words))


def open_page(window, link):
    """The page anew, ready for keys and clicks."""
    window.open("about:blank")
    window.open(link)
    begun(window)


def probe_at(window, x, y, good=lambda told: True):
    """What the probe shows for a position on the screen: ((column, row), DN). Waits until that is `good`, as the picture may still change."""
    def probe():
        window.mouse("Moved", x, y)
        drawn(window)
        told = rows_of(window, "Probe")
        return tuple(int(n) for n in told["x, y"].split(",")) if "," in told.get("x, y", "") else (-1, -1), told.get("DN")
    return until(probe, good)


def shown_greys(window, wanted, size=(WIDTH, HEIGHT)):
    """What the canvas shows, (width, height, bytes), once it is as wanted."""
    return until(lambda: canvas_greys(window), lambda told: told == (*size, wanted))


def live_screen(window, double):
    go(window, "live")
    check("a picture comes", window.wait_for("document.querySelector('table[aria-label=Frame]')"))
    press_button(window, "1:1")
    window.wait_for("document.querySelector('.scale').textContent === '100 %'")
    window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('single pixels')")
    double.runs = False
    for kind in "auto", "linear", "percentile", "asinh", "log":
        choose(window, ".panel select", kind)
        wanted = levels(kind, double.pixels)
        width, height, greys = shown_greys(window, wanted)
        check(f"the canvas has the pixels of the frame, {kind}", (width, height) == (WIDTH, HEIGHT) and greys == wanted,
              f"{width} x {height}, {sum(a != b for a, b in zip(greys, wanted))} differ")
    window.evaluate("(() => { for (const [k, v] of [[0, 60], [1, 300]]) { const e = document.querySelectorAll('.row input[type=number]')[k]; e.value = v; e.dispatchEvent(new Event('change', {bubbles: true})); } })()")
    window.wait_for("document.querySelector('.panel select').value === 'manual'")
    first = window.evaluate("[...document.querySelectorAll('.row input[type=number]')].map((e) => Number(e.value))")
    check("levels typed are manual ones", first == [60, 300] and window.evaluate("document.querySelector('.panel select').value") == "manual", first)
    wanted = levels("manual", double.pixels, first)
    check("the canvas has the pixels of the frame, manual", shown_greys(window, wanted)[2] == wanted)
    choose(window, ".panel select", "auto")

    left, top, width, height = place_of(window)
    origin = left + (width - WIDTH) // 2, top + (height - HEIGHT) // 2
    for at in range(25):
        x, y = (37 * at + 11) % WIDTH, (59 * at + 400) % HEIGHT
        wanted = (x, y), str(double.pixels[y * WIDTH + x])
        (px, py), dn = probe_at(window, origin[0] + x + 0.5, origin[1] + y + 0.5, lambda told: told == wanted)
        if ((px, py), dn) != wanted:
            check(f"the probe at {x}, {y} shows the pixel's DN", False, f"{px}, {py}: {dn}, wanted {double.pixels[y * WIDTH + x]}")
            break
    else:
        check("the probe shows the DN of 25 pixels", True)
    _, dn = probe_at(window, origin[0] + 300.5, origin[1] + 250.5, lambda told: told[0] == (300, 250))
    electrons = float(window.text("#probe-electrons").replace("\u202f", ""))
    check("electrons are those of the linear model", abs(electrons - (int(dn) - BLACK_DN) / GAIN_DN_PER_E) <= 0.51, electrons)
    for _ in range(6):
        window.mouse("Wheel", origin[0] + 300.5, origin[1] + 250.5, deltaX=0, deltaY=-120)
    check("the wheel zooms", window.wait_for("parseFloat(document.querySelector('.scale').textContent) > 300"))
    window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('single pixels')")
    before, dn = probe_at(window, origin[0] + 300.5, origin[1] + 250.5, lambda told: told[1] == str(double.pixels[told[0][1] * WIDTH + told[0][0]]))
    check("the probe shows the pixel's DN there too", dn == str(double.pixels[before[1] * WIDTH + before[0]]), (before, dn))
    scale = float(window.text(".scale").split()[0])
    window.mouse("Wheel", origin[0] + 300.5, origin[1] + 250.5, deltaX=0, deltaY=-120)
    window.wait_for(f"parseFloat(document.querySelector('.scale').textContent) > {scale}")
    after, _ = probe_at(window, origin[0] + 300.5, origin[1] + 250.5)
    check("the pixel at the pointer stays there", max(abs(a - b) for a, b in zip(before, after)) <= 1, (before, after))
    told = rows_of(window, "Digital numbers")
    check("the saturated pixels are those of the whole frame", told["saturated pixels"] == str(double.histogram["saturated"]), told)
    check("the bodies are listed", window.evaluate("[...document.querySelectorAll('details.panel')].some((d) => /^Bodies in frame.*asteroid/.test(d.textContent))"))
    press_button(window, "fit")
    # Lower left ends of what has the colour of bodies: the name stands at the upper right.
    ends = """(() => { const c = document.querySelector('canvas.overlay'), d = c?.getContext('2d').getImageData(0, 0, c.width, c.height).data; let x = Infinity, y = 0;
      for (let k = 0; c && k < d.length / 4; ++k) if (d[4 * k] > 240 && d[4 * k + 2] < 110 && d[4 * k + 3] > 200) x = Math.min(x, k % c.width), y = Math.max(y, k / c.width | 0); return c && y ? [x, y] : null; })()"""
    scale = min(width / WIDTH, height / HEIGHT)
    body = double.truth()["bodies"][0]
    wanted = [(body["x"] + 0.5 - body["radius_px"] - WIDTH / 2) * scale + width / 2, (body["y"] + 0.5 + body["radius_px"] - HEIGHT / 2) * scale + height / 2]
    found = until(lambda: window.evaluate(ends), lambda found: found and all(abs(a - b) < 2 for a, b in zip(found, wanted)))
    check("the limb is where the truth says", found and all(abs(a - b) < 2 for a, b in zip(found, wanted)), (found, wanted))

    # A window too small for single pixels: blocks, by their largest or mean. Nothing asks for numbers before the pointer does.
    double.jpeg = base64.b64decode(window.evaluate("""(() => { const c = Object.assign(document.createElement('canvas'), {width: 320, height: 256}), x = c.getContext('2d');
      x.fillStyle = '#5a5a5a'; x.fillRect(0, 0, 320, 256); return c.toDataURL('image/jpeg').split(',')[1]; })()"""))
    window.resize(700, 400)
    open_page(window, double.link)
    said = window.wait_for("document.querySelector('.stage-side')?.textContent.includes('A JPEG')")
    greys = until(lambda: set(canvas_greys(window)[2]), lambda greys: greys and greys <= set(range(0x56, 0x5f)))
    check("where the server sends JPEG it is shown, and said to be one", said and greys and greys <= set(range(0x56, 0x5f)), greys)
    check("of which no number is shown", window.text("#probe-dn") == "–")
    left, top, width, height = place_of(window)
    window.mouse("Moved", left + width / 2, top + height / 2)
    check("the pointer asks for numbers", window.wait_for("document.querySelector('#probe-dn').textContent !== '–' && !document.querySelector('.stage-side').textContent.includes('A JPEG')"))
    double.jpeg = None
    window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('of 2 x 2')")
    double.beat()
    for reduce, words in ("max", "largest"), ("mean", "mean"):
        choose(window, ".toolbar select", reduce)
        double.beat()
        window.wait_for(f"document.querySelector('table[aria-label=Frame]').textContent.includes('{words} of')")
        left, top, width, height = place_of(window)
        bin = int(rows_of(window, "Frame")["shown as"].split()[-1])

        def block_at(px, py):
            return reduced(double.pixels, px // bin * bin, py // bin * bin, bin, bin, bin, reduce)[0]
        (px, py), dn = probe_at(window, left + width / 2 - 20.3, top + height / 2 + 30.3, lambda told: told[1] == str(block_at(*told[0])))
        block = block_at(px, py)
        check(f"binned, the probe shows the {words} of the block, and says so", dn == str(block) and f"{words} of {bin} x {bin}" in window.text(".probe-panel"), (px, py, dn, block))
    window.resize(1280, 900)
    window.wait_for("innerWidth === 1280 && document.querySelector('.stage canvas').width === document.querySelector('.stage').clientWidth && document.querySelector('.stage').clientWidth === 878")
    double.runs = True


def region(window, double):
    press_button(window, "1:1")
    window.wait_for("document.querySelector('.scale').textContent === '100 %'")
    window.evaluate("document.querySelector('.stage canvas').focus()")
    window.press("r")
    left, top, width, height = place_of(window)
    origin = left + (width - WIDTH) // 2, top + (height - HEIGHT) // 2
    window.wait_for("document.querySelector('.stage.drawing')")
    size = until(lambda: canvas_greys(window)[:2], lambda told: told == (WIDTH, HEIGHT))
    check("the picture is 1:1", size == (WIDTH, HEIGHT), size)
    window.mouse("Pressed", origin[0] + 101.5, origin[1] + 51.5, button="left", clickCount=1)
    for x, y in (150, 100), (250, 150), (303, 203):
        window.mouse("Moved", origin[0] + x + 0.5, origin[1] + y + 0.5, button="left", buttons=1)
    window.mouse("Released", origin[0] + 303.5, origin[1] + 203.5, button="left", clickCount=1)
    shown = window.wait_for("(() => { const q = [...document.querySelectorAll('.quad input')].map((e) => e.value).join(); return q === '640,512,0,0' ? '' : q; })()")
    print("region", shown)
    double.asked.clear()
    press_button(window, "stop, set, start")
    check("the region is set", window.wait_for("document.querySelector('.side').textContent.includes('Set: ')"))
    wanted = {"Width": 204, "Height": 154, "OffsetX": 100, "OffsetY": 50}  # 101.5 to 303.5 and 51.5 to 203.5 in steps of 4 and 2
    check("the acquisition stops, the region in whole increments is set, and it starts again",
          [(m, p.rsplit("/", 1)[1], b) for m, p, b in double.asked] == [("POST", "acquisition", {"running": False}), ("PATCH", "features", wanted), ("POST", "acquisition", {"running": True})], double.asked)
    check("the picture has the region's size", window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('204 x 154')"))
    window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('single pixels')")
    press_button(window, "1:1")
    wanted = levels("auto", reduced(double.pixels, 100, 50, 204, 154, 1, "max"))
    check("the canvas has the region's pixels", shown_greys(window, wanted, (204, 154)) == (204, 154, wanted))
    press_button(window, "whole sensor")
    check("the whole sensor returns", window.wait_for("document.querySelector('table[aria-label=Frame]').textContent.includes('640 x 512')"))


def holding(window, double):
    """The frame on the screen, held while others come: all of it, its truth, its file, and the frames after it compared with it."""
    double.runs = False
    first, changed = double.pixels, double.pixels[:]
    for k in range(1000):
        changed[k * 211 % len(changed)] = first[k * 211 % len(changed)] + 1 + k % 9
    double.beat()
    frame = window.wait_for(f"document.querySelector('table[aria-label=Frame] td').textContent === '{double.frame}' && '{double.frame}'")
    check("the age of the picture is that of the server's stamps", window.wait_for("/^[0-9.]+ m?s$/.test(document.querySelector('#age').textContent)"), window.text("#age"))
    press_button(window, "hold")
    window.wait_for("document.querySelector('.badge')?.textContent.startsWith('held')")
    double.pixels = changed
    double.cache.clear()
    double.runs = True
    asked, badges = until(lambda: (frame in double.truths, window.text(".stage-badges")), lambda told: told[0] and "overlays: frame" not in told[1])
    check("so are its overlays", asked and "overlays: frame" not in badges, (double.truths[-3:], frame, badges))
    press_button(window, "1:1")
    window.wait_for("document.querySelector('.scale').textContent === '100 %' && document.querySelector('table[aria-label=Frame]').textContent.includes('single pixels')")
    choose(window, ".panel select", "linear")
    until(lambda: double.frame, lambda newest: newest >= int(frame) + 3)  # others come meanwhile
    wanted = levels("linear", first)
    check("a frame that is held stays, and all of it is there", shown_greys(window, wanted) == (WIDTH, HEIGHT, wanted) and rows_of(window, "Frame")["frame"] == frame, rows_of(window, "Frame"))
    left, top, width, height = place_of(window)
    x, y = left + (width - WIDTH) // 2 + 372.5, top + (height - HEIGHT) // 2 + 250.5
    window.click(x, y)
    check("a click asks what the scene says of the pixel", window.wait_for("document.querySelector('table[aria-label=\"Truth of the pixel\"]')") and double.probed == {"x": "372", "y": "250", "frame": frame}, double.probed)
    told = rows_of(window, "Truth of the pixel")
    wanted = {"pixel, frame": f"372, 250; {frame}", "DN": str(first[250 * WIDTH + 372]), "electrons, exact": "1234.5", "irradiance": "0.000004 W/m²", "· red": "0.0000025 W/m²", "· 450 nm": "0.0000015 W/m²",
              "body": "asteroid", "range": "39481.25 m", "latitude, longitude": "-12.25°, 101.5°", "incidence": "33.5°", "emission": "8.25°", "phase": "41°", "samples": "64"}
    check("and shows all of the answer", wanted.items() <= told.items(), {k: (v, told.get(k)) for k, v in wanted.items() if told.get(k) != v})
    folder = pathlib.Path(window.downloads.name)
    press_button(window, "FITS")
    window.wait_for(f"document.querySelector('.side').textContent.includes('Saved frame {frame}')")
    file = folder / f"frame_{int(frame):06}.fits"
    saved = until(lambda: file.read_bytes() if file.exists() else None, lambda told: told == first.tobytes())
    check("the frame on the screen is saved, not the newest", saved == first.tobytes(), list(folder.iterdir()))

    press_button(window, "keep this frame to compare with")
    window.wait_for("document.querySelector('select[name=compare]')")
    window.evaluate("document.querySelector('.stage canvas').focus()")
    window.press(" ")
    window.wait_for(f"Number(document.querySelector('table[aria-label=Frame] td').textContent) > {frame}")
    double.runs = False
    choose(window, "select[name=compare]", "difference")
    window.wait_for("document.querySelector('table[aria-label=Difference]')")
    by = [b - a for a, b in zip(first, changed)]
    most = max(by)
    wanted = {"differing pixels": str(sum(d != 0 for d in by)), "least, most": f"{min(by)}, {most} DN"}
    told = until(lambda: rows_of(window, "Difference"), lambda told: wanted.items() <= told.items())
    check("the difference of two frames is that of their numbers", wanted.items() <= told.items(), told)
    wanted = bytes(math.floor(128 + 127 / most * d + 0.5) for d in by)
    check("the canvas shows it about middle grey", shown_greys(window, wanted)[2] == wanted)
    choose(window, "select[name=compare]", "blink")
    window.wait_for("!document.querySelector('table[aria-label=Difference]')")
    seen = []
    turns = {levels("linear", first), levels("linear", changed)}
    until(lambda: seen.append(canvas_greys(window)[2]), lambda _: turns <= set(seen))
    check("they are shown by turns", set(seen) == turns, len(set(seen)))
    press_button(window, "forget")
    double.pixels = first
    double.cache.clear()
    double.runs = True
    choose(window, ".panel select", "auto")


def overlays(window):
    inked = """(() => { const c = document.querySelector('canvas.overlay'); if (!c) return 0; const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
      let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n; })()"""
    window.wait_for(inked)
    with_stars = window.evaluate(inked)
    window.evaluate("document.querySelector('input[name=layer-stars]').click()")
    check("each overlay can be switched off", window.wait_for(f"{inked} < {with_stars}"))
    open_page(window, double.link)
    window.wait_for(inked)
    check("which is remembered", window.evaluate("[...document.querySelectorAll('.layers input')].map((e) => e.checked)") == [True, True, True, False, False, False])
    window.evaluate("document.querySelector('input[name=layer-stars]').click()")
    window.evaluate("document.querySelector('.stage canvas').focus()")
    window.press("b")
    check("a key takes all away", window.wait_for("!document.querySelector('canvas.overlay')"))
    window.press("b")
    check("and brings them back", window.wait_for(inked))


def plots(window, double):
    """Cursor, zoom and lines of the plots of the screen Timing by keys, and the rows of a frame."""
    text = "document.querySelector('.plot').getAttribute('aria-valuetext')"
    at = {name: double.TIMING_COLUMNS.index(name) for name in ("edge_ns", "seen_ns", "worst_row_ns", "worst_row")}

    def of(number):
        return next(row for row in double.timing if row[0] == number)

    check("plots: they are drawn", window.wait_for("document.querySelectorAll('.plot canvas').length === 2"))
    window.evaluate("document.querySelector('.plot').focus()")
    window.press("End")
    window.wait_for(f"{text}.startsWith('frame ')")
    first = int(window.evaluate(text).split(":")[0].split()[1])
    window.press("ArrowLeft")
    check("plots: an arrow key moves the cursor by a frame", window.wait_for(f"{text}.startsWith('frame {first - 1}:')"), window.evaluate(text))
    told = window.evaluate(text).split("trigger seen ")[1].split(" us")[0]
    seen = (of(first - 1)[at["seen_ns"]] - of(first - 1)[at["edge_ns"]]) / 1e3
    check("plots: and tells the figures of that frame", abs(float(told) - seen) <= 0.006 * seen, (told, seen))
    legends = until(lambda: window.evaluate("[...document.querySelectorAll('.legend .at')].map((e) => e.textContent)"), lambda told: told == [f"frame {first - 1}"] * 2)
    check("plots: in both plots", legends == [f"frame {first - 1}"] * 2, legends)
    shown = "[...document.querySelectorAll('.legend button')].filter((b) => b.textContent === 'all frames').length"
    window.press("+")
    check("plots: plus zooms both", window.wait_for(f"{shown} === 2"))
    window.press("Escape")
    check("plots: Escape shows all again", window.wait_for(f"{shown} === 0"))
    line = "[...document.querySelectorAll('.legend button')].find((b) => b.textContent.startsWith('rendered'))"
    window.evaluate(f"{line}.click()")
    check("plots: a line is hidden", window.wait_for(f"{line}.getAttribute('aria-pressed') === 'false'"))
    window.evaluate(f"{line}.click()")
    window.evaluate("document.querySelector('.plot').focus()")
    window.press("Enter")
    rows = window.wait_for("document.querySelector('table[aria-label=Rows]')") and rows_of(window, "Rows")
    frame = of(int(window.text("#t-of").split()[3].rstrip(",")))
    worst = max(frame[at["worst_row_ns"]] // 1000, 2)
    check("plots: Enter shows the rows of the frame", rows and rows["rows that left"] == f"{HEIGHT} of {HEIGHT}" and window.wait_for("document.querySelectorAll('.plot canvas').length === 3")
          and (worst <= 2 or rows["latest row"].startswith(f"{frame[at['worst_row']]}, ")), (rows, frame))
    press_button(window, "close")
    check("plots: which can be closed", window.wait_for("document.querySelectorAll('.plot canvas').length === 2"))
    late = max(double.timing, key=lambda row: row[at["worst_row_ns"]])[0]
    window.evaluate("document.querySelector('section[aria-labelledby=t-worst] tbody button').click()")
    check("plots: one of the worst frames shows its rows", window.wait_for("document.querySelector('table[aria-label=Rows]')") and of(late)[at["worst_row_ns"]] >= 9_000_000
          and rows_of(window, "Rows")["latest row"].endswith("9 ms"), rows_of(window, "Rows"))
    window.wait_for("document.querySelectorAll('.plot canvas').length === 3")
    window.evaluate("document.querySelector('#t-of').scrollIntoView()")
    window.screenshot(output / "timing-rows.png")
    press_button(window, "close")


def other_screens(window, double):
    go(window, "timing")
    check("timing: a plot of the stages with its table", window.wait_for("document.querySelectorAll('.timeplot').length === 2 && document.querySelectorAll('.screen .grid tbody tr').length > 10"))
    missed = rows_of(window, "Missed triggers by reason")
    check("timing: missed triggers by reason", missed == {"lost edge": "0", "chip busy": "2", "rendering": "1", "latch full": "0", "stopped": "0"}, missed)
    worst = max(double.timing, key=lambda row: row[14])
    first = window.evaluate("[...document.querySelector('section[aria-labelledby=t-worst] tbody tr').children].map((c) => c.textContent)")
    check("timing: the worst frame stands first, with what was wrong", first[0] in [str(r[0]) for r in double.timing if r[14] == worst[14]] and "late rows" in first[-1], first)
    at = dict(zip(double.TIMING_COLUMNS, next(r for r in double.timing if str(r[0]) == first[0])))
    stages = {"rendering": at["render_end_ns"] - at["render_begin_ns"], "the release": at["last_ns"] - at["last_due_ns"]}  # the others take less than a ms, or four
    longest = max(stages, key=stages.get)
    check("timing: and the stage that made it late, by name", first[1] == "9 ms" and first[-2].startswith(f"{longest}, ") and abs(float(first[-2].split()[-2]) - stages[longest] / 1e6) < 0.006 * stages[longest] / 1e6, (first, stages))
    told = rows_of(window, "Clock")
    check("timing: state of the clock, and PTP", told == {"state": "locked", "source": "pps", "trigger ready": "yes", "PTP": "locked", "PTP offset": "-0.35 us", "PTP path delay": "1.24 us"}, told)
    check("timing: histograms describe themselves", window.evaluate("[...document.querySelectorAll('.histogram svg')].every((s) => /median/.test(s.getAttribute('aria-label')))"))
    plots(window, double)
    go(window, "camera")
    window.wait_for("document.querySelector('#f-Gain')")
    shown = window.evaluate("Object.fromEntries([...document.querySelectorAll('.features tbody tr')].filter((r) => r.querySelector('input,select') && !r.dataset.feature.includes('[') && r.checkVisibility()).map((r) => [r.children[0].textContent, [r.querySelector('input,select').type === 'checkbox'"
                            " ? r.querySelector('input').checked : r.querySelector('input,select').value, r.querySelector('input,select').disabled, r.children[2].textContent]]))")
    wanted = {n: [r["value"] if isinstance(r["value"], bool) else f"{r['value']:g}" if isinstance(r["value"], float) else str(r["value"]), r["locked"], r.get("unit", "")] for n, r in double.features.items()}
    check("camera: every feature with value, unit and lock", shown == wanted, {n: (shown.get(n), wanted[n]) for n in wanted if shown.get(n) != wanted[n]})
    double.asked.clear()
    window.click_on("#f-Gain")
    window.evaluate("document.querySelector('#f-Gain').select()")
    window.write("6.5")
    window.press("Enter")
    check("camera: a typed value is set by Enter, and the answer is shown", window.wait_for("document.querySelector('form .said').textContent.includes('Gain = 6.5')"))
    check("camera: only what was edited is sent", double.asked == [("PATCH", f"/api/v1/cameras/{CAMERA}/features", {"Gain": 6.5})], double.asked)
    check("camera: what the sensor makes of the settings", rows_of(window, "Readout").get("highest frame rate") == "10.204 Hz" and "(asked 16 ms)" in rows_of(window, "Readout")["window 0: 640 x 512 at 0, 0"],
          rows_of(window, "Readout"))
    listed = "[...document.querySelectorAll('.features tbody tr')].map((r) => r.dataset.feature)"
    names = window.evaluate(listed)
    check("camera: a beginner sees no items of selectors", "DeviceUserID" in names and "DeviceReset" not in names and not any("[" in name for name in names), names)
    choose(window, "#level", "Expert")
    window.wait_for("document.querySelector('[data-feature=\"CounterValue[Counter0]\"]')")
    names = window.evaluate(listed)
    check("camera: features of the GigE Vision side beside those, none twice", "TriggerMode[AcquisitionStart]" in names and "CounterValue[Counter0]" in names and "TriggerMode[FrameStart]" not in names
          and len(set(names)) == len(names), names)
    choose(window, "#level", "Beginner")
    choose(window, "#user-set", "UserSet1")
    double.asked.clear()
    press_button(window, "save ...")
    press_button(window, "yes, save")
    check("camera: a user set is saved after a question", window.wait_for("document.querySelector('section[aria-labelledby=c-sets] .said').textContent.includes('Saved as UserSet1')") and
          [b for _, _, b in double.asked] == [{"UserSetSelector": "UserSet1"}, {"UserSetSave": True}], double.asked)
    window.evaluate("(() => { const e = document.querySelector('input[type=search]'); e.value = 'userid'; e.dispatchEvent(new Event('input', {bubbles: true})); })()")
    window.wait_for("document.getElementById('f-DeviceUserID')?.checkVisibility()")
    window.click_on("#f-DeviceUserID")
    window.evaluate("document.querySelector('#f-DeviceUserID').select()")
    window.write("a name that is far too long")
    window.press("Enter")
    check("camera: a refusal stands beside its feature", window.wait_for("document.querySelector('[data-feature=DeviceUserID] .refused')?.textContent.includes('up to 16')"))
    press_button(window, "forget")
    press_button(window, "software trigger")
    check("camera: a refusal is shown in the daemon's words", window.wait_for("document.querySelector('.said.bad')?.textContent.includes('not On and Software')"))
    press_button(window, "stop")
    check("camera: stopped, the verdict says so", window.wait_for("document.querySelector('#verdict').textContent.includes('idle')"))
    press_button(window, "start")
    window.wait_for("document.querySelector('#verdict').textContent.includes('on time')")
    go(window, "scene")
    window.wait_for("document.querySelector('form select option[value=moon]')")  # other screens have forms, too
    choose(window, "form select", "moon")
    press_button(window, "show")
    shown = until(lambda: rows_of(window, "Scene").get("shown"), lambda told: told == "moon")
    check("scene: another one is shown", shown == double.shown == "moon", (shown, double.shown, window.text(".said")))
    phase = math.degrees(math.acos((1e11 - 0) / math.hypot(1.1e11, 1e11)))
    window.wait_for("document.querySelector('section[aria-labelledby=s-bodies] tbody tr')")
    cells = window.evaluate("[...document.querySelectorAll('section[aria-labelledby=s-bodies] tbody tr')].map((r) => [...r.children].map((c) => c.textContent.replaceAll('\\u202f', '')))")
    check("scene: bodies as a tree, with size and phase angle", cells[0][0] == "asteroid" and cells[0][2] == "237" and abs(float(cells[0][6]) - phase) < 0.01 and cells[1][0].startswith("└ lander on asteroid"), cells)
    check("scene: where the camera's pose comes from, and its age", rows_of(window, "Scene")["camera's pose"] == "simulator, 118 poses, newest of 23.5 s, 0.04 s old", rows_of(window, "Scene"))
    body = window.evaluate("(() => { const c = document.querySelector('.map .body'); return [...['cx', 'cy', 'r'].map((n) => Number(c.getAttribute(n)))]; })()")
    # 39500.2 m ahead, 118.5 px of 0.01 degrees in radius; the view has 460 px, of which 26 + 40 are edges.
    radius = 39500.2 * math.sin(math.radians(1.185))
    scale = (460 - 26 - 40) / (39500.2 + radius)
    check("scene: the map is to scale", all(abs(a - b) < 0.2 for a, b in zip(body, [26 + 39500.2 * scale, 115, radius * scale])), (body, scale))
    window.evaluate("document.querySelector('section[aria-labelledby=s-time] summary').click()")
    double.asked.clear()
    press_button(window, "send")
    check("scene: a pose is sent", window.wait_for("document.querySelector('section[aria-labelledby=s-time]').textContent.includes('Taken: camera')") and
          double.asked == [("POST", f"/api/v1/cameras/{CAMERA}/pose", {"name": "camera", "time_s": 0, "position_m": [0, 0, 0], "orientation": [1, 0, 0, 0]})], double.asked)
    double.lockstep = True
    window.wait_for("document.querySelector('#step-by')")
    press_button(window, "step")
    check("scene: in lockstep a step makes a frame", window.wait_for("document.querySelector('section[aria-labelledby=s-time]').textContent.includes('of 0.1 s: complete')") and
          double.asked[-1][2] == {"time_s": 0.1}, double.asked)
    press_button(window, "next trajectory point")
    check("scene: the next point of a trajectory", window.wait_for("document.querySelector('section[aria-labelledby=s-time]').textContent.includes('of 2.5 s: complete')") and
          double.asked[-1][2] == {"time_s": 2.5}, double.asked)
    press_button(window, "next trajectory point")
    check("scene: after the last there is none", window.wait_for("[...document.querySelectorAll('section[aria-labelledby=s-time] button')].find((b) => b.textContent === 'next trajectory point').disabled && document.querySelector('section[aria-labelledby=s-time]').textContent.includes('of 4 s')"))
    double.lockstep = False
    go(window, "faults")
    press_button(window, "every 10th frame skipped")
    check("faults: a template arms a rule", window.wait_for("document.querySelector('.bad-item')?.textContent.includes('1 ARMED')") and double.rules == [{"kind": "skip_frame", "every": 10}], double.rules)
    check("faults: the table says how often it has struck", window.wait_for("document.querySelector('.grid tbody tr')?.textContent.includes('skip frameevery 10all framesof the daemonan operator7')"))
    press_button(window, "disarm all")
    check("faults: all are disarmed", window.wait_for("document.querySelector('.items').textContent.includes('faultsnone')") and double.rules == [])
    window.evaluate("document.querySelectorAll('input[name=holds]')[1].click()")
    window.evaluate("(() => { const e = document.querySelector('#fault-frames'); e.value = 20; e.dispatchEvent(new Event('input', {bubbles: true})); })()")
    double.runs = False
    frame = double.frame
    window.wait_for(f"document.querySelector('section[aria-labelledby=x-rules]').textContent.replaceAll('\\u202f', '').includes('Newest frame of the stream: {frame}.')")
    press_button(window, "picture frozen")
    check("faults: a rule for the next 20 frames", window.wait_for("document.querySelector('.grid tbody tr')?.textContent.includes('freeze frame')") and
          double.rules == [{"kind": "freeze_frame", "first": frame + 1, "last": frame + 20}], (double.rules, frame))
    for _ in range(25):
        double.beat()
    check("faults: once its frames have passed it is over, and no longer armed", window.wait_for("document.querySelector('.grid tbody tr').textContent.includes('over') && document.querySelector('.items').textContent.includes('faultsnone')"))
    double.runs = True
    window.evaluate("(() => { const e = [...document.querySelectorAll('.form label')].find((l) => l.textContent.startsWith('share')).querySelector('input'); e.value = 300; e.dispatchEvent(new Event('input', {bubbles: true})); })()")
    press_button(window, "arm")
    check("faults: a refused number is marked, with the daemon's words", window.wait_for("document.querySelector('.refused-field')?.textContent.startsWith('share') && document.querySelector('p.refused')?.textContent.includes('0 to 100')"))
    press_button(window, "disarm all")
    window.wait_for("!document.querySelector('section[aria-labelledby=x-rules] tbody')")
    go(window, "transports")
    window.wait_for("document.querySelector('table[aria-label=\"GigE Vision\"]')")
    told = rows_of(window, "GigE Vision")
    check("transports: counters are the daemon's", told.get("resend requests") == "4", told)
    check("transports: where the stream goes", rows_of(window, "Channels").get("stream to") == "192.168.1.20:41000", rows_of(window, "Channels"))
    check("transports: why there is no node", "No such file" in window.text("section[aria-labelledby=p-v4l2] .trouble"))
    check("transports: room on the disk", rows_of(window, "Files, place").get("free on its disk") == "212 GiB", rows_of(window, "Files, place"))
    check("transports: an operator takes control from nobody", not window.evaluate("[...document.querySelectorAll('button')].some((b) => b.textContent.includes('disconnect'))"))
    go(window, "system")
    window.wait_for("document.querySelectorAll('#log tbody tr').length === 5")
    check("system: the log, newest first, markup as text", window.evaluate("document.querySelector('#log tbody tr:last-child').textContent").endswith("/etc/obscura/<moon> &amp.toml"))
    check("system: keys with where they come from, without defaults", window.wait_for("document.querySelector('section[aria-labelledby=y-configuration] tbody')?.textContent.includes('trigger.rate_hz5Hz--set')")
          and not window.evaluate("document.querySelector('section[aria-labelledby=y-configuration]').textContent.includes('late_policy')"))
    window.evaluate("document.querySelector('#log tbody tr:last-child button').click()")
    check("system: a line of the log has its meaning from the catalogue", window.wait_for("document.querySelector('.meaning')?.textContent.includes('Version and configuration')"))
    choose(window, "#log-level", "debug")
    check("system: the log level is set", window.wait_for("document.querySelector('#y-log').parentNode.textContent.includes('writes debug and')") and double.log_level == "debug")
    threads = window.evaluate("[...document.querySelectorAll('section[aria-labelledby=y-threads] tbody tr')].map((r) => [...r.children].map((c) => c.textContent))")
    check("system: threads with their cores", threads[1][:6] == ["release", "fifo", "75", "0", "3", "3"], threads)
    check("system: what differs from the default is bold", window.evaluate("[...document.querySelectorAll('section[aria-labelledby=y-configuration] strong')].map((e) => e.textContent)") == ["pps"])
    check("system: an operator has no support bundle and no reload", not window.evaluate("[...document.querySelectorAll('button')].some((b) => /bundle|reload/.test(b.textContent))"))
    check("system: what was changed is listed", window.wait_for("document.querySelector('section[aria-labelledby=y-audit] tbody')?.textContent.includes('skip_frame')"))


def as_admin(window, double):
    """What only an admin may: take control away, reload, fetch the support bundle."""
    double.role, double.controller = "admin", "192.168.1.20:50211"
    open_page(window, double.link)
    go(window, "transports")
    double.asked.clear()
    press_button(window, "disconnect ...")
    check("a question comes first", double.asked == [] and window.wait_for("document.querySelector('.confirm')?.textContent.includes('192.168.1.20:50211')"))
    press_button(window, "yes, disconnect")
    check("then control is taken away", window.wait_for("document.querySelector('.items').textContent.includes('controlled bynone')") and [p.rsplit("/", 1)[1] for _, p, _ in double.asked] == ["release"], double.asked)
    go(window, "system")
    press_button(window, "reload the file ...")
    press_button(window, "no")
    press_button(window, "reload the file ...")
    press_button(window, "yes, reload the file")
    check("the file is reloaded, once", window.wait_for("document.querySelector('section[aria-labelledby=y-configuration]').textContent.includes('is in use')") and [p.rsplit("/", 1)[1] for _, p, _ in double.asked] == ["release", "reload"], double.asked)
    press_button(window, "download support bundle")
    folder = pathlib.Path(window.downloads.name)
    window.wait_for("document.querySelector('section[aria-labelledby=y-daemon]').textContent.includes('Saved obscura-support-test')")
    saved = until(lambda: [f.read_bytes() for f in folder.glob("*.zst")], lambda told: told == [b"bundle"])
    check("the support bundle is saved as the server gave it", saved == [b"bundle"], list(folder.iterdir()))
    double.role = "operator"
    open_page(window, double.link)


def by_keyboard(window):
    """Digits reach the screens; on each the tabulator reaches every control, all of which have names."""
    window.evaluate("document.activeElement.blur()")
    for number, screen in enumerate(SCREENS):
        window.press(str(number + 1))
        check(f"key {number + 1}: {screen}", window.wait_for(f"location.hash === '#{screen}'"))
        there(window, screen)
        window.evaluate("window.all = [...document.querySelectorAll('a[href], button, select, input, summary, [tabindex]')].filter((e) => !e.disabled && e.checkVisibility() && (e.type !== 'radio' || e.checked)); window.reached = new Set(); document.activeElement.blur()")
        missing = "all.filter((e) => e.isConnected && !e.disabled && !reached.has(e)).map((e) => e.outerHTML.slice(0, 80))"
        for _ in range(2 * window.evaluate("all.length") + 20):  # controls that come meanwhile are in the way
            window.press("Tab")
            window.evaluate("reached.add(document.activeElement)")
            if not (missed := window.evaluate(missing)):
                break
        check(f"{screen}: the tabulator reaches everything", missed == [], missed)
        nameless = window.evaluate("[...document.querySelectorAll('button, select, input, a[href]')].filter((e) => !(e.textContent.trim() && e.tagName !== 'SELECT') && !e.ariaLabel && !e.labels?.length).map((e) => e.outerHTML)")
        check(f"{screen}: every control has a name", nameless == [], nameless)
        images = window.evaluate("[...document.querySelectorAll('svg, canvas')].filter((e) => !e.ariaLabel && e.ariaHidden !== 'true').map((e) => e.outerHTML.slice(0, 80))")
        check(f"{screen}: every picture is described, or left out", images == [], images)
        window.evaluate("document.activeElement.blur()")


def refusals(window, double):
    double.refuse = {"/features": (503, "this daemon takes no calls: set control.unix_socket"), "/timing": (404, "the paths are: / /livez"), "/audit": (403, "the role admin is wanted")}
    open_page(window, double.link)
    go(window, "camera")
    check("without calls the screen says which key to set", window.wait_for("document.querySelector('.note')?.textContent.includes('set control.unix_socket')"))
    go(window, "timing")
    check("an older server is named", window.wait_for("document.querySelector('.screen').textContent.includes('a later version')"))
    go(window, "system")
    check("what the role may not see is not there", window.wait_for("document.querySelector('#y-log') && !document.querySelector('#y-audit')"))
    double.refuse, double.controller = {}, "192.168.1.20:50211"
    go(window, "camera")
    window.wait_for("document.querySelector('#f-Gain')")
    window.click_on("#f-Gain")
    window.evaluate("document.querySelector('#f-Gain').select()")
    window.write("3")
    window.press("Enter")
    check("a camera that another controls is not changed, and the page says by whom", window.wait_for("document.querySelector('.said.bad')?.textContent.includes('controlled by 192.168.1.20:50211')"))
    double.controller, double.role = "", "viewer"
    open_page(window, double.link)
    for screen, word in ("camera", "start"), ("faults", "disarm all"), ("scene", "show"):
        go(window, screen)
        window.wait_for("document.querySelector('.items')?.textContent.includes('viewer') && performance.getEntriesByType('resource').some((e) => e.name.endsWith('/api/v1/me') && e.responseEnd > 0) && document.querySelector('main .screen, main section')")
        drawn(window)
        check(f"a viewer has no button {word}", not window.evaluate(f"[...document.querySelectorAll('button')].some((b) => b.textContent === '{word}')"))
    window.open("about:blank")
    window.open(double.link.replace("known", "wrong"))
    check("a wrong token: the page says what to do", window.wait_for("document.querySelector('#verdict')?.textContent.includes('This token is not known')"))
    asked = double.requests
    window.evaluate("new Promise((done) => setTimeout(() => done(0), 1500))")  # three times the pause between two questions
    check("and does not go on trying it", double.requests == asked, double.requests - asked)


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
                check(f"{screen}, {theme}, {width}: it has all that it shows", there(window, screen))
                if screen == "live":
                    window.mouse("Moved", 420, 480)
                    window.wait_for("document.querySelector('#probe-dn').textContent !== '–'")
                drawn(window)
                window.screenshot(output / f"{screen}-{theme}-{width}.png")
                wide = window.evaluate("document.documentElement.scrollWidth > innerWidth")
                check(f"{screen}, {theme}, {width}: nothing is cut off at the side", not wide)


def narrow(window, double):
    """A telephone: no screen scrolls sideways, as a whole or in a part, and cells say what they are."""
    over = """[...document.querySelectorAll('*')].filter((e) => e.tagName !== 'THEAD' && e.clientWidth > 1 && e.scrollWidth > e.clientWidth + 1 && ['auto', 'scroll'].includes(getComputedStyle(e).overflowX))
      .map((e) => [e.tagName, e.className, e.scrollWidth, e.clientWidth])"""
    unnamed = """[...document.querySelectorAll('table.grid')].filter((t) => t.tHead).flatMap((t) => [...t.tBodies].flatMap((b) => [...b.rows])).flatMap((r) => [...r.cells]).filter((c) => c.dataset.label === undefined).length"""
    for role in "operator", "admin":
        double.role = role
        for theme in ("dark", "light") if role == "operator" else ("dark",):
            window.resize(390, 844)
            window.open("about:blank")
            window.open(double.link)
            choose(window, "#theme", theme)
            for screen in SCREENS:
                go(window, screen)
                check(f"{screen}, {theme}, {role}, 390: it has all that it shows", there(window, screen))
                drawn(window)
                window.wait_for(f"{unnamed} === 0")
                if role == "operator":
                    window.screenshot(output / f"{screen}-{theme}-390.png")
                widths = window.evaluate("[document.documentElement.scrollWidth, document.documentElement.clientWidth, document.body.scrollWidth]")
                check(f"{screen}, {theme}, {role}, 390: nothing scrolls sideways", max(widths) <= 390 == widths[1] and window.evaluate(over) == [], (widths, window.evaluate(over)))
                check(f"{screen}, {theme}, {role}, 390: cells have the names of their columns", window.evaluate(unnamed) == 0, window.evaluate(unnamed))


double = PageDouble(page)
with browser.Browser() as window:
    window.open(double.link)
    live_screen(window, double)
    region(window, double)
    holding(window, double)
    overlays(window)
    other_screens(window, double)
    as_admin(window, double)
    by_keyboard(window)
    # That this test looks at the canvas is no fault of the page.
    window.complaints = [c for c in window.complaints if "willReadFrequently" not in c]
    expected = [c for c in window.complaints if "status of 409" in c or "status of 422" in c]
    check("the browser complains of nothing but the refusals that were asked for", window.complaints == expected and len(expected) == 3, window.complaints)
    window.complaints.clear()
    refusals(window, double)
    check("after refusals too", all("Failed to load resource" in c for c in window.complaints), window.complaints)
    window.complaints.clear()
    pictures(window, double)
    narrow(window, double)
    check("nor while screens change", window.complaints == [], window.complaints)
double.close()
end()
