# SPDX-License-Identifier: Apache-2.0
"""What tests read of the page of obscura-web in a window, and its paths with the token of its link."""
import base64
import json
import urllib.request

from checks import PATIENCE_S

# What each screen shows once it has the answers to all that it asks.
THERE = {
    "live": "document.querySelector('table[aria-label=Frame]') && document.querySelector('.dn-histogram')",
    "timing": "document.querySelectorAll('.timeplot canvas').length === 2 && document.querySelector('section[aria-labelledby=t-worst]')",
    "camera": "document.querySelector('#f-Gain') && document.querySelector('section[aria-labelledby=c-readout]') && document.querySelector('#user-set')",
    "scene": "document.querySelector('form select') && document.querySelector('section[aria-labelledby=s-bodies] tbody tr')",
    "faults": "document.querySelector('section[aria-labelledby=x-rules] p.small')",
    "transports": "document.querySelector('main table.facts')",
    "models": "document.querySelector('#m-editor')?.shadowRoot?.querySelector('.cm-content') && document.querySelector('section[aria-labelledby=m-parameters] table') && !document.querySelector('#m-picture').hidden",
    "system": "document.querySelector('#log tbody tr') && document.querySelector('section[aria-labelledby=y-configuration] tbody')",
}


def begun(window):
    """Waits until the page has been drawn, and what it told its scripts to do after that has been done."""
    window.wait_for("document.querySelector('nav a[aria-current]')")
    drawn(window)


def drawn(window):
    """Waits until what has happened in the page is on the screen."""
    window.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))")


def there(window, screen):
    """Waits until a screen has all that it shows."""
    return window.wait_for(f"document.querySelector('nav a[aria-current]')?.getAttribute('href') === '#{screen}' && {THERE[screen]}")



def go(window, screen):
    window.wait_for("document.querySelector('nav a[aria-current]')")  # a page that has not begun goes to its own screen
    window.evaluate(f"location.hash = '{screen}'")
    window.wait_for(f"document.querySelector('nav a[aria-current]')?.getAttribute('href') === '#{screen}'")


def rows_of(window, label):
    """Names and values of a table of facts."""
    return dict(window.evaluate(f"[...document.querySelectorAll('table[aria-label={json.dumps(label)}] tr')].map((r) => [...r.children].map((c) => c.textContent.replaceAll('\\u202f', '')))"))


def press_button(window, words, within="document"):
    """Clicks the first button with exactly that text that can be pressed; false: there is none."""
    script = f"[...{within}.querySelectorAll('button')].find((b) => b.textContent.trim() === {json.dumps(words)} && !b.disabled)"
    found = window.wait_for(f"!!({script})")
    if found:
        window.evaluate(f"({script}).click()")
    return bool(found)


def choose(window, selector, value):
    window.evaluate(f"(() => {{ const e = document.querySelector({json.dumps(selector)}); e.value = {json.dumps(value)}; e.dispatchEvent(new Event('change', {{bubbles: true}})); }})()")


def canvas_greys(window):
    """Grey of what the canvas shows of the image: (width, height, bytes)."""
    told = window.evaluate("""(() => { const c = document.querySelector('.stage canvas'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
      let x0 = c.width, y0 = c.height, x1 = -1, y1 = -1;
      for (let y = 0; y < c.height; ++y) for (let x = 0; x < c.width; ++x) if (d[4 * (y * c.width + x) + 3]) { x0 = Math.min(x0, x); x1 = Math.max(x1, x); y0 = Math.min(y0, y); y1 = Math.max(y1, y); }
      let text = ""; for (let y = y0; y <= y1; ++y) for (let x = x0; x <= x1; ++x) text += String.fromCharCode(d[4 * (y * c.width + x)]);
      return [x1 - x0 + 1, y1 - y0 + 1, btoa(text)]; })()""")
    return told[0], told[1], base64.b64decode(told[2])


def place_of(window):
    """The canvas on the screen: left, top, width, height."""
    return window.evaluate("(() => { const b = document.querySelector('.stage canvas').getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()")


def probe_at(window, places):
    """What the probe shows with the pointer at each of the places, from the canvas's upper left corner: (column, row, DN as it stands there)."""
    told = window.evaluate(f"""(async () => {{ const canvas = document.querySelector('.stage canvas'), told = [];
      for (const [x, y] of {json.dumps(places)}) {{
        const box = canvas.getBoundingClientRect(); // a line above that comes or goes moves it
        canvas.dispatchEvent(new PointerEvent('pointermove', {{clientX: box.x + x, clientY: box.y + y, bubbles: true}}));
        await new Promise((done) => setTimeout(done)); // until the page has shown it
        told.push([...document.querySelectorAll('table[aria-label=Probe] td')].slice(0, 2).map((c) => c.textContent.replaceAll('\\u202f', '')));
      }} return told; }})()""")
    return [(*(int(n) for n in place.split(",")), dn) if "," in place else (None, None, dn) for place, dn in told]


class Api:
    """The paths of obscura-web, with the token of its link."""

    def __init__(self, link):
        self.root, self.token = link.split("#")[0] + "api/v1/", link.partition("token=")[2]

    def ask(self, path, method="GET", body=None):
        headers = {"Authorization": f"Bearer {self.token}", "Content-Type": "application/json"}
        request = urllib.request.Request(path if path.startswith("http") else self.root + path, method=method, headers=headers, data=None if body is None else json.dumps(body).encode())
        with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
            return answer.read()

    def json(self, *arguments):
        return json.loads(self.ask(*arguments))
