#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The same numbers everywhere: a frame on the page, in the files that obscura-web makes of it and received over GigE Vision; the latencies of a
run on the page, in /metrics and of `obscura timing`.

Usage: page_truth_test.py OBSCURAD OBSCURA OBSCURA-WEB SOURCE-DIRECTORY
Exit status 77 without Chromium (Debian package chromium), 1 if a check failed.
"""
import csv
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import browser  # noqa: E402
import read_image  # noqa: E402
from checks import until  # noqa: E402
from page_view import PATIENCE_S, Api, canvas_greys, choose, go, place_of, press_button, probe_at  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402
from web_server import Web  # noqa: E402

obscurad, obscura, web, source = sys.argv[1:5]
WIDTH, HEIGHT, PIXELS, FRAMES = 320, 240, 100, 3
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)[:2000]}", flush=True)
    if not good:
        failures.append(what)


class Shown:
    """A frame on the page beside its numbers as a GigE Vision client has received them."""

    def __init__(self, window, pixels):
        self.window, self.pixels, self.random = window, pixels, random.Random(1)

    def settled(self, words):
        """Waits for a picture that is shown as said."""
        return self.window.wait_for(f"document.querySelector('table[aria-label=Frame]').textContent.includes('{words}')")

    def block(self, x, y, bin):
        return max(self.pixels[row * WIDTH + column] for row in range(y, min(y + bin, HEIGHT)) for column in range(x, min(x + bin, WIDTH)))

    def check(self, zoom, scale, image_at, bin=1):
        """`scale`: pixels of the screen to one of the image; `image_at`: place on the canvas of the image's upper left corner."""
        _, _, width, height = place_of(self.window)
        wrong, places = [], []
        for _ in range(PIXELS):
            x = self.random.uniform(max(0, image_at[0]), min(width, image_at[0] + scale * WIDTH) - 1)
            y = self.random.uniform(max(0, image_at[1]), min(height, image_at[1] + scale * HEIGHT) - 1)
            places.append((x, y))
        for place, (x, y, dn) in zip(places, probe_at(self.window, places)):
            wanted = [(at - origin) / scale for at, origin in zip(place, image_at)]
            # The page keeps pixels of the image on whole ones of the screen.
            if x is None or max(abs(at + 0.5 - want) for at, want in zip((x, y), wanted)) > 0.5 + 1 / scale + 1e-6 or dn != str(self.block(x // bin * bin, y // bin * bin, bin)):
                wrong.append((place, wanted, x, y, dn))
        check(f"{zoom}: the page shows the numbers that came over GigE Vision, {PIXELS} pixels", wrong == [], wrong)


def centred(window, scale):
    _, _, width, height = place_of(window)
    return [(width - scale * WIDTH) / 2, (height - scale * HEIGHT) / 2]


def wheeled(size, image, pointer, origin):
    """Where the image begins after a turn of the wheel, in one direction: the point at the pointer stays, as far as the image's edges allow,
    and the image begins on a whole pixel of the canvas. `image`: its size then."""
    begins = pointer - 1.25 * (pointer - origin)
    begins = (size - image) / 2 if image <= size else min(0, max(size - image, begins))
    return -math.floor(0.5 - begins)


def frames(window, api, camera, folder, address):
    """A frame that a GigE Vision client has triggered: its numbers on the page at three zooms, binned, and in each file."""
    api.ask(f"cameras/{camera}/acquisition", "POST", {"running": True})
    go(window, "live")
    check("live pictures come", window.wait_for("document.querySelector('table[aria-label=Frame]')"), window.text(".stage-note"))
    api.ask(f"cameras/{camera}/acquisition", "POST", {"running": False})
    grab = subprocess.run([obscura, "grab", "--address", address, "--frames", str(FRAMES), "--software-trigger-rate", "2", "--format", "raw", "--no-preview", "-o", folder / "grabbed"],
                          capture_output=True, text=True, timeout=PATIENCE_S)
    check("frames come over GigE Vision", grab.returncode == 0, grab)
    received = (folder / f"grabbed/frame_{FRAMES:06}.raw").read_bytes()
    pixels = memoryview(received).cast("H").tolist()
    check("which are no plain picture", len(pixels) == WIDTH * HEIGHT and len(set(pixels)) > 20, (len(pixels), len(set(pixels))))
    check("the page shows the last of them", window.wait_for(f"document.querySelector('table[aria-label=Frame] td').textContent === '{FRAMES}'"), window.text("table[aria-label=Frame]"))
    known = api.json(f"cameras/{camera}/frames/latest.json")
    files = {kind: api.ask(f"cameras/{camera}/frames/{known['id']}.{kind}") for kind in ("raw", "png", "fits")}
    same = {"raw": files["raw"] == received, "png": list(read_image.read_png(files["png"])[0]) == pixels, "fits": list(read_image.read_fits(files["fits"])[0]) == pixels}
    check("its files have the numbers that came over GigE Vision", known["frame"] == str(FRAMES) and all(same.values()), (known, same))

    shown = Shown(window, pixels)
    choose(window, ".panel select", "linear")
    press_button(window, "fit")
    shown.settled("single pixels")
    _, _, width, height = place_of(window)
    scale = min(width / WIDTH, height / HEIGHT)
    shown.check("fit", scale, centred(window, scale))
    press_button(window, "1:1")
    window.wait_for("document.querySelector('.scale').textContent === '100 %'")
    shown.settled("single pixels")
    full = 2 ** known["bits"] - 1
    window.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    greys = canvas_greys(window)
    check("1:1: so does the canvas", greys == (WIDTH, HEIGHT, bytes(int(255 * dn / full + 0.5) for dn in pixels)), greys[:2])
    choose(window, ".panel select", "auto")
    window.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    by = window.evaluate(f"""(async () => {{
      const answer = await fetch('api/v1/cameras/{camera}/frames/{known['id']}.jpg', {{headers: {{Authorization: 'Bearer {api.token}'}}}}), bitmap = await createImageBitmap(await answer.blob());
      const c = Object.assign(document.createElement('canvas'), {{width: bitmap.width, height: bitmap.height}}), x = c.getContext('2d');
      x.drawImage(bitmap, 0, 0);
      const shown = document.querySelector('.stage canvas'), {{data: a}} = x.getImageData(0, 0, c.width, c.height);
      const {{data: b}} = shown.getContext('2d').getImageData(Math.round((shown.width - c.width) / 2), Math.round((shown.height - c.height) / 2), c.width, c.height);
      let sum = 0;
      for (let k = 0; k < a.length; k += 4) sum += (a[k] - b[k]) ** 2;
      return [answer.headers.get('Content-Type'), c.width, c.height, Math.sqrt(sum / (a.length / 4)), new Set(b).size]; }})()""")
    # Its quality is 85 of 100; the pixels' noise is what it loses.
    check("its JPEG is the picture with the contrast of previews, as the page shows it", by[:3] == ["image/jpeg", WIDTH, HEIGHT] and by[3] < 8 and by[4] > 20, by)
    choose(window, ".panel select", "linear")
    origin = [round(at) for at in centred(window, 1)]
    shown.check("1:1", 1, origin)
    at = [round(corner + 130) for corner in origin]  # the wheel turns at whole pixels
    _, _, width, height = place_of(window)
    scale = 1
    for _ in range(9):
        window.evaluate(f"""(() => {{ const canvas = document.querySelector('.stage canvas'), box = canvas.getBoundingClientRect();
          canvas.dispatchEvent(new WheelEvent('wheel', {{clientX: Math.round(box.x) + {at[0]}, clientY: Math.round(box.y) + {at[1]}, deltaY: -120, bubbles: true, cancelable: true}})); }})()""")
        scale *= 1.25
        origin = [wheeled(*where) for where in zip((width, height), (scale * WIDTH, scale * HEIGHT), at, origin)]
    window.wait_for(f"Math.abs(parseFloat(document.querySelector('.scale').textContent) - {100 * scale}) < 1")
    shown.settled("single pixels")
    shown.check("zoomed by the wheel", scale, origin)
    window.resize(700, 190)
    press_button(window, "fit")
    shown.settled("largest of 2 x 2")
    _, _, width, height = place_of(window)
    scale = min(width / WIDTH, height / HEIGHT)
    shown.check("fit, largest of 2 x 2", scale, centred(window, scale), bin=2)
    window.resize(1280, 900)


NAMES = {"Trigger to first row": ("trigger_to_first_row", "edge_to_first_row"), "Trigger to last row": ("trigger_to_last_row", "edge_to_last_row"),
         "Trigger seen": ("trigger_seen", "edge_to_seen"), "Render": ("render", "rendering"), "Detector": ("detector", "render_end_to_detector_end"),
         "First byte, file": ("trigger_to_first_byte", "edge_to_first_byte_file"), "First byte, gige": ("trigger_to_first_byte", "edge_to_first_byte_gige"),
         "Release lateness": ("release_lateness", None)}  # of each waking of the thread that releases rows, which the file does not have


def up_to_shown(window):
    """Counts up to each bound, of each histogram since the start on the screen Timing."""
    return window.evaluate("Object.fromEntries([...document.querySelectorAll('.histograms .histogram')].map((h) => [h.querySelector('h3').textContent, "
                           "[...h.querySelectorAll('tbody tr')].map((r) => Number(r.children[2].textContent.split('(')[0].replace(/[^0-9]/g, '')))]))")


def up_to_metrics(api):
    text = api.ask(api.root.removesuffix("api/v1/") + "metrics").decode()
    told = {}
    for title, (name, _) in NAMES.items():
        transport = title.partition("First byte, ")[2]
        label = f'[^}}]*transport="{transport}"[^}}]*' if transport else "[^}]*"
        told[title] = [int(n) for n in re.findall(rf"^obscura_{name}_seconds_bucket{{{label}}} (\d+)$", text, re.M)]
    return told


def up_to_timing(file):
    """The same of `obscura timing`, which has a table for each acquisition; and the worst frames of the last: frame, us, late rows, worst row, why."""
    done = subprocess.run([obscura, "timing", file, "--format", "csv"], capture_output=True, text=True, timeout=PATIENCE_S)
    rows = list(csv.reader(done.stdout.split("\n\n")[0].splitlines()))
    told = {}
    for title, (_, span) in NAMES.items():
        counts = [[int(n) for n in row[7:]] for row in rows[1:] if row[1] == span]
        totals = [sum(column) for column in zip(*counts)]
        told[title] = [sum(totals[:k + 1]) for k in range(len(totals))]
    table = list(csv.reader(done.stdout.split("\n\n")[1].splitlines()))[1:]
    return told, [row[1:] for row in table if row[0] == table[-1][0]]


def counted(api):
    """Counters of the camera, and how many frames the stages have more than have ended: they are counted half a second later."""
    told = api.json("state")["daemons"][0]["cameras"][0]
    seen, ended = told["stages_us"]["trigger_seen"]["count"], told["camera"]["complete"] + told["camera"]["abandoned"]
    return told["camera"], seen, seen - ended, told["camera"]["frames"] == ended


def run(api, camera, frames, **features):
    """At least so many frames of the timer, then none. How often a trigger has been seen when all of them are counted."""
    begun, _, more, _ = counted(api)  # no frame has ended for seconds
    api.ask(f"cameras/{camera}/features", "PATCH", {"TriggerSource": "Line0", **features})
    until(lambda: counted(api)[0]["complete"], lambda now: now >= begun["complete"] + frames)
    api.ask(f"cameras/{camera}/features", "PATCH", {"TriggerSource": "Software"})
    return until(lambda: counted(api), lambda told: told[3] and told[2] == more)[1]


def metrics_with(api, seen):
    return until(lambda: up_to_metrics(api), lambda told: told["Trigger seen"][-1:] == [seen])


def latencies(window, api, camera, end_daemon, file):
    """Of a run whose triggers have stopped; then with rows that cannot be ready in time, since a mark."""
    api.ask(f"cameras/{camera}/acquisition", "POST", {"running": True})
    wanted = metrics_with(api, run(api, camera, 10))
    go(window, "timing")
    shown = until(lambda: up_to_shown(window), lambda told: all(told.get(title) == wanted[title] for title in NAMES))
    different = {title: (shown.get(title), wanted[title]) for title in NAMES if shown.get(title) != wanted[title]}
    check("each bucket of /metrics is a row of the screen Timing", all(wanted.values()) and not different, different or wanted)
    check("the page sets a mark", press_button(window, "mark now") and window.wait_for("document.querySelector('#t-start').textContent.startsWith('Since the mark')"))
    shown = up_to_shown(window)
    check("from which it counts anew", shown.keys() == wanted.keys() and all(set(counts) == {0} for counts in shown.values()), shown)
    later = metrics_with(api, run(api, camera, 12, ExposureTime=1))
    wanted = {title: [after - before for after, before in zip(later[title], wanted[title])] for title in NAMES}
    shown = until(lambda: up_to_shown(window), lambda told: all(told.get(title) == wanted[title] for title in NAMES))
    different = {title: (shown.get(title), wanted[title]) for title in NAMES if shown.get(title) != wanted[title]}
    check("while the daemon counts on", not different and later["Trigger seen"][-1] > wanted["Trigger seen"][-1] >= 12, different or (later, wanted))
    press_button(window, "remove the mark")
    rows = api.json(f"cameras/{camera}/timing?most=256")
    acquisition = [row[rows["columns"].index("acquisition")] for row in rows["rows"]]
    window.wait_for(f"document.querySelector('#t-stages').textContent.endsWith('last {acquisition.count(acquisition[-1])} frames')")
    read_worst = "[...document.querySelectorAll('section[aria-labelledby=t-worst] tbody tr')].map((r) => [...r.children].map((c) => c.textContent.replaceAll('\\u202f', '')))"
    end_daemon()
    filed, worst = up_to_timing(file)
    compared = {title: (filed[title], later[title]) for title, (_, span) in NAMES.items() if span}
    check("its buckets are those of obscura timing", all(filed_ == later_ for filed_, later_ in compared.values()), {title: both for title, both in compared.items() if both[0] != both[1]})
    check("none of which is empty", all(counts[-1] for _, counts in compared.values()), compared)
    shown = window.evaluate(read_worst)
    # Each program has its own order of frames that are equally late.
    late = {row[0]: row for row in worst if float(row[1]) > 0}
    check("the worst frames, and the stage that made each late, are those of obscura timing", len(late) > 3 and [row[0] for row in shown if row[0] in late] == list(late)
          and all(row[2] == late[row[0]][2] and row[-2].split(",")[0].strip() == late[row[0]][4].split(",")[0].strip() for row in shown if row[0] in late), (shown, worst))


if browser.missing():
    print(f"skipped: {browser.missing()}")
    sys.exit(77)
with tempfile.TemporaryDirectory(prefix="obscura-page-") as temporary, browser.Browser() as window:
    folder, pid = pathlib.Path(temporary), os.getpid()
    address = f"127.{128 + (pid >> 14 & 63)}.{pid >> 6 & 255}.{(pid & 63) * 4 + 2}"
    small = SmallDaemon(folder, obscurad, source, size=(WIDTH, HEIGHT), gige=f'interface = "{address}"', tables=f'[control]\nunix_socket = "{folder}/calls"\n')
    daemon = small.start("--timing", folder / "run.csv")
    server = Web(web, "--role", "operator", "--socket", small.socket)
    api, camera = Api(server.link), f"{daemon.pid}-0"
    until(lambda: [one for told in api.json("state")["daemons"] for one in told["cameras"]], bool)
    window.open(server.link)
    frames(window, api, camera, folder, address)

    def end_daemon():
        daemon.terminate()
        daemon.wait(PATIENCE_S)

    latencies(window, api, camera, end_daemon, folder / "run.csv")
    # That this test looks at the canvas is no fault of the page; that the daemon has ended neither.
    complaints = [c for c in window.complaints if "willReadFrequently" not in c and "/api/v1/" not in c]
    check("the browser complains of nothing", complaints == [], complaints)
    server.end()
sys.exit(1 if failures else 0)
