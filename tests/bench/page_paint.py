#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How soon the page of obscura-web stands in Chromium, each time with an empty cache.

Usage: page_paint.py OBSCURAD OBSCURA-WEB [--rounds 9]
Prints medians and the largest of the first contentful paint (the browser's own figure) and of the first picture of the camera on
the canvas, both after the link was opened, and the bytes that came for the page, as sent (compressed).
"""
import argparse
import pathlib
import statistics
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "tests/support"))
import browser  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402
from web_server import Web  # noqa: E402

parser = argparse.ArgumentParser(usage=__doc__)
parser.add_argument("obscurad")
parser.add_argument("web")
parser.add_argument("--rounds", type=int, default=9)
options = parser.parse_args()
if why := browser.missing():
    sys.exit(why)

paints, pictures, sizes = [], [], []
with tempfile.TemporaryDirectory(prefix="obscura-paint-") as folder:
    camera = SmallDaemon(folder, options.obscurad, SOURCE, size=(512, 512))
    daemon = camera.start()
    web = Web(options.web, "--socket", camera.socket)
    for _ in range(options.rounds):
        with browser.Browser() as window:
            window.open(web.link)
            paint = window.wait_for("performance.getEntriesByName('first-contentful-paint')[0]?.startTime")
            # A canvas that shows nothing has one colour.
            window.wait_for("(() => { const c = document.querySelector('canvas'); if (!c?.width) return false;"
                            "const d = new Uint32Array(c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer);"
                            "return d.some((v) => v !== d[0]); })()")
            pictures.append(window.evaluate("performance.now()"))
            paints.append(paint)
            sizes.append(window.evaluate("performance.getEntriesByType('resource').concat(performance.getEntriesByType('navigation'))"
                                         ".filter((e) => !e.name.includes('/api/')).reduce((n, e) => n + e.encodedBodySize, 0)"))
        time.sleep(0.2)
    web.process.kill()
    daemon.kill()
    daemon.wait()
print(f"first contentful paint: median {statistics.median(paints):.0f} ms, largest {max(paints):.0f} ms of {len(paints)}")
print(f"first picture: median {statistics.median(pictures):.0f} ms, largest {max(pictures):.0f} ms")
print(f"the page: {statistics.median(sizes):.0f} bytes")
