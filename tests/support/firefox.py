# SPDX-License-Identifier: Apache-2.0
"""Firefox without a window, driven by WebDriver BiDi over its own debugging port: no driver, no package besides Firefox itself."""
import base64
import json
import pathlib
import re
import select
import shutil
import subprocess
import tempfile
import time

from websocket_client import WebSocket
from window import PATIENCE_S, WATCH_POLICY, Window

KEYS = {"Tab": "\ue004", "Enter": "\ue007", " ": " ", "Escape": "\ue00c", "Shift": "\ue008",
        "ArrowLeft": "\ue012", "ArrowUp": "\ue013", "ArrowRight": "\ue014", "ArrowDown": "\ue015"}
# Nothing that Firefox asks of its makers when it starts.
PREFERENCES = {"app.update.disabledForTesting": True, "browser.shell.checkDefaultBrowser": False, "datareporting.policy.dataSubmissionEnabled": False,
               "toolkit.telemetry.enabled": False, "browser.newtabpage.enabled": False, "network.captive-portal-service.enabled": False,
               "network.connectivity-service.enabled": False, "extensions.update.enabled": False, "app.normandy.enabled": False,
               "services.settings.server": "data:,", "browser.region.network.url": "", "accessibility.tabfocus": 7, "focusmanager.testmode": True}


def missing():
    """Why a test cannot run; "": it can."""
    return "" if shutil.which("firefox-esr") else "Firefox is not installed (Debian package firefox-esr)"


class Firefox(Window):
    """One page. `complaints`: errors and warnings of its console, and uncaught errors."""

    def __init__(self, width=1280, height=900):
        self.profile = tempfile.TemporaryDirectory(prefix="obscura-firefox-", ignore_cleanup_errors=True)
        lines = "".join(f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in PREFERENCES.items())
        (pathlib.Path(self.profile.name) / "user.js").write_text(lines)
        self.process = subprocess.Popen(
            ["firefox-esr", "--headless", "--no-remote", "--profile", self.profile.name, "--remote-debugging-port", "0", f"--width={width}", f"--height={height}"],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.number, self.answers, self.complaints = 0, {}, []
        self.socket = WebSocket(self._port(), "/session", protocol=None, timeout=PATIENCE_S)
        self.call("session.new", capabilities={})
        self.context = self.call("browsingContext.getTree")["contexts"][0]["context"]
        self.call("script.addPreloadScript", functionDeclaration=f"() => {{ {WATCH_POLICY} }}")
        self.call("session.subscribe", events=["log.entryAdded"])
        self.resize(width, height)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()
        self.process.kill()
        self.process.wait()
        self.process.stderr.close()
        self.profile.cleanup()

    def _port(self):
        end = time.monotonic() + PATIENCE_S
        while select.select([self.process.stderr], [], [], max(0.0, end - time.monotonic()))[0]:
            line = self.process.stderr.readline()
            if found := re.search(r"WebDriver BiDi listening on ws://[^:]+:(\d+)", line):
                return int(found[1])
            if not line:
                break
        raise RuntimeError("Firefox does not start")

    def call(self, method, **parameters):
        """Result of a command of WebDriver BiDi."""
        self.number += 1
        number = self.number
        self.socket.send_json({"id": number, "method": method, "params": parameters})
        while number not in self.answers:
            message = json.loads(self.socket.receive(PATIENCE_S)[1])
            if message.get("id") is not None:
                self.answers[message["id"]] = message
            elif message.get("method") == "log.entryAdded" and message["params"]["level"] in ("error", "warn"):
                self.complaints.append(message["params"]["text"])
        answer = self.answers.pop(number)
        if answer["type"] == "error":
            raise RuntimeError(f"{method}: {answer['error']}: {answer['message']}")
        return answer["result"]

    def evaluate(self, script):
        """Value of an expression; promises are waited for."""
        told = self.call("script.evaluate", expression=f"(async () => JSON.stringify((await ({script})) ?? null))()", awaitPromise=True,
                         target={"context": self.context})
        if told["type"] == "exception":
            raise RuntimeError(f"{script}: {told['exceptionDetails']['text']}")
        return json.loads(told["result"]["value"])

    def open(self, url):
        self.call("browsingContext.navigate", context=self.context, url=url, wait="complete")
        self.call("browsingContext.activate", context=self.context)

    def press(self, key, shift=False):
        value = KEYS.get(key, key)
        actions = [{"type": "keyDown", "value": value}, {"type": "keyUp", "value": value}]
        if shift:
            actions = [{"type": "keyDown", "value": KEYS["Shift"]}, *actions, {"type": "keyUp", "value": KEYS["Shift"]}]
        self.call("input.performActions", context=self.context, actions=[{"type": "key", "id": "keys", "actions": actions}])

    def write(self, text):
        for letter in text:
            self.press(letter)

    def resize(self, width, height):
        self.call("browsingContext.setViewport", context=self.context, viewport={"width": width, "height": height})

    def screenshot(self, file):
        pathlib.Path(file).write_bytes(base64.b64decode(self.call("browsingContext.captureScreenshot", context=self.context)["data"]))
