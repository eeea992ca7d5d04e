#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The screen Models of the page in a browser, before a real daemon: findings at their lines as one types, parameters, picture, a text on the
next frame and back again, roles, a telephone's width.

Usage: page_models_test.py OBSCURAD OBSCURA-WEB SOURCE-DIRECTORY OUTPUT-FOLDER
Leaves pictures in the folder, to be looked at. Exit status 77 without Chromium (Debian package chromium), 1 if a check failed.
"""
import json
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import browser  # noqa: E402
from checks import check, failures, until  # noqa: E402
from page_view import begun, choose, drawn, go, press_button, there  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402
from web_server import Web  # noqa: E402

obscurad, web_program, source, output = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]), pathlib.Path(sys.argv[4])
LAW = """// A grey law.
parameter albedo 0.1; //! , 0..1, Albedo
vec4 brdf(vec3 $i, vec3 $e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess)
{
    return diffuse * albedo * max(0, (i | n)) * M_1_PI;
}
"""
INSIDE = "document.querySelector('#m-editor').shadowRoot"
SHOWN = f"[...{INSIDE}.querySelectorAll('.cm-line')].map((l) => l.textContent).join('\\n')"
FINDINGS = "[...document.querySelectorAll('.findings li')].map((l) => l.textContent.trim())"


def replace_text(window, text):
    """Types over all of the text."""
    window.click_on("#m-editor")
    window.call("Input.dispatchKeyEvent", type="rawKeyDown", key="a", code="KeyA", windowsVirtualKeyCode=65, modifiers=2)
    window.write(text)


def colour_at(window, word):
    return window.evaluate(f"(() => {{ const s = [...{INSIDE}.querySelectorAll('.cm-line span')].find((e) => e.textContent === {json.dumps(word)}); return s ? getComputedStyle(s).color : ''; }})()")


def editing(window, web, folder, camera):
    check("the model of the scene is open", window.text("#m-text") == "Text of grey.brdf" and window.evaluate("document.querySelector('#m-which').value") == "scene/grey.brdf", window.text("#m-text"))
    check("its text is shown", window.wait_for(f"{SHOWN}.startsWith('// A grey law.')"), window.evaluate(SHOWN))
    colours = {word: colour_at(window, word) for word in ("parameter", "scalar", "max", "M_1_PI", "// A grey law.")}
    check("words have colours of their kinds", len(set(colours.values())) == 5 and all(colours.values()), colours)
    check("its parameters are told", window.evaluate("[...document.querySelectorAll('table[aria-label=Parameters] tbody tr:first-child > *')].map((c) => c.textContent)") == ["albedo", "scalar", "0.1", "0 to 1", "", "Albedo"])
    greys = window.evaluate("(() => { const c = document.querySelector('#m-picture'); return [c.width, new Set(c.getContext('2d').getImageData(0, 0, c.width, c.height).data).size]; })()")
    check("its picture is drawn", greys[0] > 400 and greys[1] > 50, greys)

    replace_text(window, LAW.replace("albedo *", "albed *").replace("    return", "    scalar q = nothing;\n    return"))
    check("findings come while one types", window.wait_for(f"{FINDINGS}.length === 2"), window.evaluate(FINDINGS))
    told = window.evaluate(FINDINGS)
    check("with line and column", told[1].startswith("line 6, 22") and "'albed' is not declared" in told[1], told)
    check("they stand at their lines in the editor", window.wait_for(f"{INSIDE}.querySelectorAll('.cm-lintRange-error').length === 2") and
          window.evaluate(f"[...{INSIDE}.querySelectorAll('.cm-lintRange-error')].map((e) => e.textContent)") == ["nothing", "albed"])
    window.evaluate("document.querySelectorAll('.findings button')[1].click()")
    check("a finding leads to its place", window.wait_for(f"{INSIDE}.activeElement?.classList.contains('cm-content')"))
    window.write("X")
    check("where one types on", window.wait_for(f"{SHOWN}.includes('Xalbed')"), window.evaluate(SHOWN))
    check("digits are no screens there", (window.press("1"), window.evaluate("location.hash"))[1] == "#models")
    window.press("Tab")
    check("the tabulator leaves the editor", window.evaluate("document.activeElement.id") != "m-editor", window.evaluate("document.activeElement.outerHTML.slice(0, 80)"))
    press_button(window, "try on the next frame")
    check("a text with mistakes is refused in one line", window.wait_for("document.querySelector('.said.bad')?.textContent.includes('is not declared')"), window.text(".said.bad"))
    check("and not stored", not (folder / "models").exists() or not list((folder / "models").iterdir()))


def trying(window, web, folder, camera):
    """A model of the folder that the scene names."""
    def mean():
        frame = lambda: int(json.loads(web.ask(f"/api/v1/cameras/{camera}/frames/latest.json?wait=10").text)["id"])
        first = frame()
        until(frame, lambda number: number > first + 3)
        pixels = memoryview(web.ask(f"/api/v1/cameras/{camera}/frames/latest.raw").content).cast("H").tolist()
        return sum(pixels) / len(pixels) - sum(pixels[:512]) / 512

    check("HTTP: a model is stored", web.ask(f"/api/v1/cameras/{camera}/models", "PUT", body={"file": "own.brdf", "text": LAW}).status == 200)
    check("HTTP: a scene shows it", web.ask(f"/api/v1/cameras/{camera}/scene", "PUT", body={"file": "other.toml"}).status == 200)
    window.evaluate("(location.reload(), 0)")
    check("then it is open", window.wait_for("document.querySelector('#m-text')?.textContent === 'Text of own.brdf'") and there(window, "models"), window.text("#m-text"))
    before = mean()
    replace_text(window, LAW.replace("albedo 0.1", "albedo 0.3"))
    check("the new text is sound", window.wait_for("document.querySelector('#m-findings').textContent.includes('sound:') && document.querySelector('table[aria-label=Parameters] td:nth-child(3)').textContent === '0.3'"), window.text("#m-findings"))
    press_button(window, "try on the next frame")
    check("it is tried", window.wait_for("document.querySelector('form + .said')?.textContent.includes('shown from the next frame on')"), window.text("form + .said"))
    check("frames are three times as bright", abs(mean() / before - 3) < 0.15, mean() / before)
    drawn(window)
    window.screenshot(output / "models.png")
    press_button(window, "undo")
    check("undo", window.wait_for("document.querySelector('form + .said')?.textContent.includes('as it was before')"), window.text("form + .said"))
    check("brings the text back", window.wait_for(f"{SHOWN}.includes('albedo 0.1')") and (folder / "models/own.brdf").read_text() == LAW)
    now = mean()
    check("and the frames", abs(now / before - 1) < 0.15, now / before)
    window.evaluate("(() => { const e = document.querySelector('#m-name'); e.value = '../x.brdf'; e.dispatchEvent(new Event('input', {bubbles: true})); return 0; })()")
    press_button(window, "store")
    check("a hostile name is refused", window.wait_for("document.querySelector('.said.bad')?.textContent.includes('no folders')"), window.text(".said.bad"))
    window.evaluate("(() => { const e = document.querySelector('#m-name'); e.value = 'second.brdf'; e.dispatchEvent(new Event('input', {bubbles: true})); return 0; })()")
    press_button(window, "store")
    check("another name is stored", window.wait_for("document.querySelector('form + .said')?.textContent === 'second.brdf is stored.'") and (folder / "models/second.brdf").exists(), window.text("form + .said"))
    press_button(window, "remove ...")
    press_button(window, "yes, remove")
    check("and removed", window.wait_for("document.querySelector('form + .said')?.textContent === 'second.brdf is removed.'") and not (folder / "models/second.brdf").exists(), window.text("form + .said"))
    choose(window, "#m-which", "shipped/akimov.brdf")
    check("a shipped model opens", window.wait_for(f"document.querySelector('#m-text').textContent === 'Text of akimov.brdf' && {SHOWN}.includes('brdf')"))
    go(window, "timing")
    go(window, "models")
    check("it is open again after another screen", window.wait_for(f"document.querySelector('#m-text')?.textContent === 'Text of akimov.brdf'") and there(window, "models"))


def looks(window):
    contrast = lambda: window.evaluate(f"getComputedStyle({INSIDE}.querySelector('.cm-editor')).color + getComputedStyle({INSIDE}.querySelector('.cm-editor')).backgroundColor")
    seen = set()
    for theme in "dark", "light", "red":
        choose(window, "#theme", theme)
        drawn(window)
        seen.add(contrast())
        window.screenshot(output / f"models-{theme}.png")
    check("the editor has the colours of three themes", len(seen) == 3, seen)
    window.resize(390, 800)
    drawn(window)
    window.screenshot(output / "models-390.png")
    check("at 390 px nothing scrolls sideways", window.evaluate("document.documentElement.scrollWidth <= 390"), window.evaluate("document.documentElement.scrollWidth"))
    window.resize(1280, 900)


if browser.missing():
    print(f"skipped: {browser.missing()}")
    sys.exit(77)
output.mkdir(parents=True, exist_ok=True)
with tempfile.TemporaryDirectory(prefix="obscura-page-models-") as temporary, browser.Browser() as window:
    folder = pathlib.Path(temporary)
    folder.chmod(0o755)
    small = SmallDaemon(folder, obscurad, source, tables=f'[control]\nunix_socket = "{folder}/calls"\nscenes = "{folder}"\n[models]\nfolder = "{folder}/models"\n')
    text = (folder / "scene.toml").read_text()
    for old, new in ("albedo = 0.1", 'material = { model = "grey.brdf" }'), ("-20000", "-400000"), ("distance_au = 2", "distance_au = 60"):
        text = text.replace(old, new)
    (folder / "grey.brdf").write_text(LAW)
    (folder / "scene.toml").write_text(text)
    (folder / "other.toml").write_text(text.replace("grey.brdf", "own.brdf"))
    daemon = small.start()
    web, viewers = Web(web_program, "--role", "operator", "--socket", small.socket), Web(web_program, "--role", "viewer", "--socket", small.socket)
    try:
        until(lambda: json.loads(web.ask("/api/v1/cameras").text)["cameras"], bool)
        camera = json.loads(web.ask("/api/v1/cameras").text)["cameras"][0]["id"]
        window.open(web.link)
        begun(window)
        loaded = "performance.getEntriesByType('resource').some((r) => r.name.includes('codemirror'))"
        check("the editor is not loaded before its screen is opened", not window.evaluate(loaded))
        go(window, "models")
        check("the screen has all that it shows", there(window, "models"))
        check("then it is", window.evaluate(loaded))
        editing(window, web, folder, camera)
        trying(window, web, folder, camera)
        looks(window)
        check("the browser complains of nothing", [line for line in window.complaints if "willReadFrequently" not in line and "422" not in line and "400" not in line] == [], window.complaints)
        check("nothing violates the security policy", window.violations() == [], window.violations())
        window.open("about:blank")
        window.open(viewers.link)
        begun(window)
        go(window, "models")
        check("a viewer sees text, findings and picture", there(window, "models"))
        check("and stores nothing", not window.evaluate("!!document.querySelector('#m-name')") and "Your role does not change models" in window.text("main"))
        refused = viewers.ask(f"/api/v1/cameras/{camera}/models", "PUT", body={"file": "own.brdf", "text": LAW})
        check("nor by HTTP", refused.status == 403, refused.text)
    finally:
        for server in web, viewers:
            server.end()
        daemon.terminate()
        daemon.wait(60)
print(f"{len(failures)} checks failed")
sys.exit(1 if failures else 0)
