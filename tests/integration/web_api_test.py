#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The interface of obscura-web: every route for every kind of token, its OpenAPI document, changes of a camera and their record,
frames, and a daemon that does not answer.

Usage: web_api_test.py OBSCURAD OBSCURA-WEB SOURCE-DIRECTORY
Answers are compared with their schemas where jsonschema is installed (Debian package python3-jsonschema). Exit status 1 if a check
failed.
"""
import grp
import io
import itertools
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tarfile
import tempfile
import time
import tomllib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import openapi_document  # noqa: E402
import web_server  # noqa: E402
from checks import until  # noqa: E402
from gvcp_client import CONTROL, CONTROL_PRIVILEGE, NO_CONTROL, GvcpClient  # noqa: E402
from read_image import read_exr, read_fits, read_png  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402
from zstd_frame import zstd  # noqa: E402

try:
    import jsonschema
except ImportError:
    jsonschema = None

obscurad, web, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
PATIENCE_S = web_server.PATIENCE_S
WIDTH, HEIGHT = 64, 48
GAIN = 0xA160  # register of the GigE Vision side
CALLS = {call["name"]: call for call in json.loads((source / "clients/calls.json").read_text())["daemon"]}
# Who may do what, of operations that are no calls of the daemon: a change here is a change of the interface, as one of clients/calls.json is.
ROLES = {"page": None, "alive": None, "ready": "viewer", "metrics": "viewer", "state": "viewer", "events": "viewer", "me": "viewer",
         "audit": "viewer", "openapi": "viewer", "cameras": "viewer", "camera": "viewer", "support-bundle": "admin", "frame.json": "viewer",
         "frame.png": "viewer", "frame.fits": "viewer", "frame.raw": "viewer", "live.mjpg": "viewer", "live.mjpg.first": "viewer",
         "frame.id.json": "viewer", "frame.id.png": "viewer", "frame.id.fits": "viewer", "frame.id.raw": "viewer",
         "frame.jpg": "viewer", "frame.id.jpg": "viewer", "frame.exr": "viewer", "frame.id.exr": "viewer", "frame": "viewer", "frame.id": "viewer"}
ADMINS = next(group for group in grp.getgrall() if group.gr_gid not in (0, os.getegid()))
HOLDERS = ["viewer", "operator", "admin"]
failures = []


def check(what, good, detail=""):
    if not good:
        failures.append(what)
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)


def wait_for(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition() and time.monotonic() < end:
        time.sleep(0.1)
    return condition()


def free_udp_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def flat(path, value):
    """Keys and values of parsed TOML as the configuration names them: elements of a list of tables by their number."""
    if isinstance(value, dict):
        for key, member in value.items():
            yield from flat(f"{path}.{key}" if path else key, member)
    elif isinstance(value, list) and value and all(isinstance(element, dict) for element in value):
        for number, element in enumerate(value):
            yield from flat(f"{path}[{number}]", element)
    else:
        yield path, value


class Document:
    """The OpenAPI document: its operations, and whether an answer is one of theirs."""

    def __init__(self, document):
        self.document = document
        self.operations = {operation["operationId"]: (method.upper(), path, operation) for path, item in document["paths"].items()
                           for method, operation in item.items()}
        self.seen = set()

    def check(self):
        check("the document is one of OpenAPI 3.1", not openapi_document.mistakes(self.document), openapi_document.mistakes(self.document))
        roles = {name: operation["x-role"] for name, (_, _, operation) in self.operations.items()}
        of_calls = {name: openapi_document.ROLES[CALLS[operation["x-call"]]["permission"]] for name, (_, _, operation) in self.operations.items() if "x-call" in operation}
        check("its operations are those that this test knows and calls of the daemon, and have their roles", roles == {**ROLES, **of_calls}, roles.items() ^ {**ROLES, **of_calls}.items())
        for name, (method, _, operation) in self.operations.items():
            check(f"{name}: body and security fit", ("requestBody" in operation) == (method != "GET") and "200" in operation["responses"] and
                  (operation.get("security") == [{}]) == (operation["x-role"] is None))

    def fits(self, name, answer):
        """Whether the document has the status and type of an answer, and its content is of the schema."""
        method, _, operation = self.operations[name]
        response = operation["responses"].get(str(answer.status))
        if response is None:
            return False
        self.seen.add(name)
        if "$ref" in response:
            response = self.document["components"]["responses"][response["$ref"].split("/")[-1]]
        if "content" not in response:
            return not answer.content
        kind = (answer.headers["Content-Type"] or "").split(";")[0]
        if kind not in response["content"]:
            return False
        schema = response["content"][kind].get("schema")
        if schema and jsonschema:
            resolver = jsonschema.RefResolver("", self.document)
            errors = list(jsonschema.Draft202012Validator(schema, resolver=resolver).iter_errors(json.loads(answer.text)))
            for error in errors:
                print("  ", error.message[:300])
            return not errors
        return not kind.endswith("json") or isinstance(json.loads(answer.text), dict)


with tempfile.TemporaryDirectory(prefix="obscura-web-api-") as temporary:
    folder = pathlib.Path(temporary)
    camera = SmallDaemon(folder, obscurad, source, tables=f'[control]\nunix_socket = "{folder}/calls"\nadmin_group = "{ADMINS.gr_name}"\n')
    gvcp = free_udp_port()
    camera.config.write_text(camera.config.read_text().replace(
        "[gige]\nenabled = false", f'[daemon]\nautostart = true\n[gige]\nenabled = true\ninterface = "127.0.0.1"\nport = {gvcp}'))
    tokens = {role: subprocess.run([web, "--tokens", folder / "tokens", "--new-token", role, "--name", f"{role}-1"], capture_output=True, text=True,
                                   check=True).stdout.strip().partition("token=")[2] for role in HOLDERS}
    server = web_server.Web(web, "--socket", camera.socket, "--tokens", folder / "tokens")
    daemon = camera.start()
    state = {}

    def ask(name, body=None, role="operator", query="", camera_id=None, feature="Gain", **headers):
        method, path, _ = document.operations[name]
        answer = server.ask(path.replace("{camera}", camera_id or ID).replace("{frame}", frame_id).replace("{feature}", feature) + query, method, tokens.get(role, role), body, **headers)
        check(f"{name}{query} {body if body is not None else ''} is answered as the document says: {answer.status}",
              answer.status in (401, 403, 415, 421, 429) or document.fits(name, answer), answer.text[:300])
        return answer

    def found():
        global state
        state = json.loads(server.ask("/api/v1/state", token=tokens["viewer"]).text)
        cameras = [camera for daemon in state["daemons"] for camera in daemon["cameras"]]  # none while the daemon starts
        return bool(cameras) and cameras[0]["camera"]["complete"] > 0

    check("the camera is found", wait_for(found), state)
    ID = state["daemons"][0]["cameras"][0]["id"]
    document = Document(json.loads(server.ask("/api/v1/openapi.json", token=tokens["viewer"]).text))
    check("the camera's id is process and number", ID == f"{daemon.pid}-0" and state["daemons"][0]["daemon"]["control"] == str(folder / "calls"), ID)
    document.check()

    # Roles x routes.
    wrong = 0
    frame_id = json.loads(server.ask(f"/api/v1/cameras/{ID}/frames/latest.json?wait=10", token=tokens["viewer"]).text)["id"]
    for name, (method, path, operation) in document.operations.items():
        wanted, path = operation["x-role"], path.replace("{camera}", ID).replace("{frame}", frame_id).replace("{feature}", "Gain")
        body = None if method == "GET" else {"no such": 1}
        query = "?wait=0" if "/frames/latest" in path and not path.endswith(".exr") else "?follow=0" if name == "events" else ""
        for holder in ["", "wrong", *HOLDERS]:
            answer = server.ask(path + query, method, tokens.get(holder, holder), body)
            if wanted is None:
                good = answer.status == 200 and document.fits(name, answer)
            elif holder not in HOLDERS:
                wrong += holder == "wrong"
                # After five wrong ones the address is heard with a right one only.
                good = answer.status == (429 if wrong > 5 or (wrong == 5 and not holder) else 401)
            elif HOLDERS.index(holder) < HOLDERS.index(wanted):
                good = answer.status == 403
            else:
                good = answer.status not in (401, 403, 404, 405, 415, 421, 429, 500) and document.fits(name, answer)
            check(f"{name} {'without a token' if not holder else f'with the token of {holder}'}: {answer.status}", good, answer.text[:300])
        if method != "GET":
            for kind in "text/plain", "application/x-www-form-urlencoded", "multipart/form-data", "application/jsonx":
                check(f"{name} as {kind} is refused", server.ask(path, method, tokens["admin"], b"{}", Content_Type=kind).status == 415)
            check(f"{name} from a page of another site is refused", server.ask(path, method, tokens["admin"], {}, Origin="http://bench.example").status == 403)
        check(f"{name} under another host's name is refused", server.ask(path, method, tokens["admin"], body, Host="bench.example").status == 421)
        others = {"GET", "POST", "PUT", "PATCH", "DELETE"} - {m.upper() for m in document.document["paths"][document.operations[name][1]]}
        refused = server.ask(path, sorted(others)[0], tokens["admin"], {})
        check(f"{name}: another method is refused with those that there are", refused.status == 405 and method in refused.headers["Allow"], refused.headers)
    check("force is for admin", ask("features.set", {"Gain": 1}, query="?force=true").status == 403)
    check("a token's role and name", json.loads(ask("me").text) == {"role": "operator", "name": "operator-1"})

    # Cameras, and what a mistyped path may mean.
    listed = json.loads(ask("cameras").text)
    check("the cameras are listed", [(c["id"], c["number"], c["daemon"], c["address"]) for c in listed["cameras"]] == [(ID, 0, daemon.pid, f"127.0.0.1:{gvcp}")], listed)
    check("one of them by its number, which the next run of the daemon has, too", json.loads(ask("camera", camera_id="0").text)["id"] == ID and
          ask("features", camera_id="0").status == 200 and ask("features", camera_id="1").status == 404 and ask("camera", camera_id="1-1").status == 404)
    for path, meant in ("/api/v1/stat", "/api/v1/state"), (f"/api/v1/cameras/{ID}/featrues", f"/api/v1/cameras/{ID}/features"), ("/metric", "/metrics"):
        told = server.ask(path)
        check(f"{path}: {meant} is proposed", told.status == 404 and json.loads(told.text)["detail"].endswith(f"did you mean {meant}?"), told.text)
    check("a path that is like none is only refused", "did you mean" not in server.ask("/" + "x" * 5000).text + server.ask("/abcdefghijk").text)

    # A pixel of a frame, while frames come.
    x, y = 30, 20
    answer = until(lambda: ask("probe", query=f"?x={x}&y={y}"), lambda answer: answer.status == 200)
    pixel = json.loads(answer.text)
    file = folder / "frames" / f"frame_{int(pixel['frame']):06}.raw" if answer.status == 200 else folder
    check("a pixel of the newest frame has the number of the file", wait_for(lambda: file.is_file() and file.stat().st_size == 2 * WIDTH * HEIGHT) and
          pixel["dn"] == struct.unpack_from("<H", file.read_bytes(), 2 * (y * WIDTH + x))[0], pixel)
    check("and what it shows", pixel["body"] == "body0" and pixel["irradiance_w_m2"] > 0 and abs(pixel["range_m"] - 19600) < 200 and
          pixel["electrons"]["exact"] > 0 and "DN" in pixel["formula"], pixel)
    for query in "", "?x=3", f"?x=3&y={HEIGHT}", f"?x={WIDTH}&y=3", "?x=-1&y=0", "?x=1.5&y=0":
        check(f"probe{query} is refused", ask("probe", query=query).status == 422)
    gone = ask("probe", query=f"?x=1&y=1&frame={10**9}")
    check("a frame that is gone is said to be", gone.status == 409 and "is not kept any more" in json.loads(gone.text)["detail"], gone.text)

    # Settings.
    rows = ask("features")
    value = {row["name"]: row["value"] for row in json.loads(rows.text)["features"]}
    changed = ask("features.set", {"Gain": 3, "ExposureTime": 50})
    check("settings change together", json.loads(changed.text) == {"changed": {"Gain": 3.0, "ExposureTime": 50.0}}, changed.text)
    again = ask("features")
    check("the tag of settings changes with them", rows.headers["ETag"] != again.headers["ETag"] == changed.headers["ETag"])
    check("what is known already is not sent again", ask("features", If_None_Match=again.headers["ETag"]).status == 304)
    late = ask("features.set", {"Gain": 5}, If_Match=rows.headers["ETag"])
    check("a change of what has changed since is refused", late.status == 412 and json.loads(late.text)["type"] == "urn:obscura:changed", late.text)
    check("and one of what was read is made", ask("features.set", {"Gain": 5}, If_Match=again.headers["ETag"]).status == 200)
    one = ask("feature")
    row = json.loads(one.text)
    check("one setting by its name", row == next(r for r in json.loads(ask("features").text)["features"] if r["name"] == "Gain") and
          (row["value"], row["unit"], row["min"], row["max"], row["access"], row["locked_by"]) == (5, "dB", 0, 24, "rw", None), row)
    width = json.loads(ask("feature", feature="Width").text)
    check("with its increment, and why it cannot change", width["increment"] >= 1 and width["max"] == WIDTH and width["locked_by"] == "not while it acquires", width)
    missing = ask("feature", feature="Gian")
    check("one that is not there, with the nearest name", missing.status == 404 and json.loads(missing.text)["detail"].endswith('did you mean "Gain"?') and
          ask("feature.set", {"value": 1}, feature="Gian").status == 404, missing.text)
    changed = ask("feature.set", {"value": 4}, If_Match=one.headers["ETag"])
    check("it changes by itself", json.loads(changed.text) == {"changed": {"Gain": 4.0}} and changed.headers["ETag"] == ask("feature").headers["ETag"], changed.text)
    check("not if it has changed since", ask("feature.set", {"value": 3}, If_Match=one.headers["ETag"]).status == 412 and ask("feature.set", {}).status == 422)
    wrong_value = ask("feature.set", {"value": 300})
    check("a value that is refused has its place and the daemon's text", wrong_value.status == 422 and
          json.loads(wrong_value.text)["errors"][0]["pointer"].endswith("Gain") and "allowed 0 to 24 dB" in json.loads(wrong_value.text)["errors"][0]["detail"], wrong_value.text)
    ask("feature.set", {"value": 5})
    for body, text in ({"Gain": 300, "ExposureTime": 5000}, "allowed 0 to 24 dB"), ({"NoSuch": 1}, "NoSuch"), ({"Gain": [1]}, "Gain"):
        refused = ask("features.set", body)
        check(f"{body} is refused with the daemon's text", refused.status == 422 and text in json.loads(refused.text)["detail"], refused.text)
    values = {row["name"]: row["value"] for row in json.loads(ask("features").text)["features"]}
    check("a refused change changes nothing", values == {**value, "Gain": 5.0, "ExposureTime": 50.0})
    locked = ask("features.set", {"Width": 32})
    check("what cannot change now says so", locked.status == 409 and "acquires" in json.loads(locked.text)["detail"], locked.text)

    # Acquisition, trigger, frames.
    stopped = ask("acquisition", {"running": False})
    check("the acquisition stops, once", json.loads(stopped.text) == {"running": False, "changed": True} and
          not json.loads(ask("acquisition", {"running": False}).text)["changed"])
    check("a trigger without an acquisition is refused", ask("trigger").status == 415 and ask("trigger", {}).status == 409)
    ask("features.set", {"TriggerSource": "Software"})
    ask("acquisition", {"running": True})
    before = ask("frame.json", query="?wait=0")
    told = ask("trigger", {})
    told = json.loads(told.text)
    check("a trigger is answered with its frame", told["accepted"] and told["outcome"] in ("complete", "late") and told["frame"] == "1", told)
    newest = ask("frame.json", query=f"?after={json.loads(before.text)['id'] if before.content else 0}&wait=10")
    known = json.loads(newest.text)
    check("the newest frame is known", known["width"] == WIDTH and known["height"] == HEIGHT and known["exposure_us"] == 50 and known["gain_db"] == 5, known)
    check("and not sent again", ask("frame.json", query="?wait=0", If_None_Match=newest.headers["ETag"]).status == 304)
    check("waiting for another one ends", ask("frame.png", query=f"?after={known['id']}&wait=0.2").status == 204)
    raw, png, fits, jpeg = (ask(f"frame.{kind}") for kind in ("raw", "png", "fits", "jpg"))
    numbers = struct.unpack(f"<{WIDTH * HEIGHT}H", raw.content)
    check("PNG, FITS and the numbers are one frame", read_png(png.content)[0] == numbers == read_fits(fits.content)[0] and max(numbers) > min(numbers))
    check("the JPEG is one", jpeg.headers["Content-Type"] == "image/jpeg" and jpeg.content[:2] == b"\xff\xd8" and jpeg.content[-2:] == b"\xff\xd9", jpeg.headers)
    check("their headers name it", {a.headers["X-Obscura-Frame"] for a in (raw, png, fits, jpeg)} == {known["frame"]} and
          raw.headers["Content-Disposition"].endswith('.raw"') and read_fits(fits.content)[2]["FRAMEID"] == known["frame"])
    for accept, wanted in ("image/fits", fits), ("image/png;q=0.5, image/jpeg", jpeg), ("application/octet-stream", raw), ("*/*", png), ("image/*;q=0.3, text/html", png), \
            ("image/png;q=0, application/fits", fits):
        got = ask("frame", Accept=accept)
        check(f"Accept: {accept}", got.content == wanted.content and got.headers["ETag"] == wanted.headers["ETag"] and got.headers["Vary"] == "Accept", got.headers)
    check("as JSON, too", json.loads(ask("frame", Accept="application/json").text)["id"] == known["id"])
    check("not in a form that there is not", {ask("frame", Accept=accept).status for accept in ("text/html", "image/webp, video/*", "image/png;q=0")} == {406})
    check("their headers tell exposure and gain", (raw.headers["X-Obscura-Exposure-us"], raw.headers["X-Obscura-Gain-dB"]) == ("50.0", "5.0"), raw.headers)
    rows = [numbers[y * WIDTH:(y + 1) * WIDTH] for y in range(HEIGHT)]
    part = ask("frame.raw", query="?x=3&y=40&w=20&h=30")
    check("a part of it has the numbers of that part", struct.unpack(f"<{20 * 8}H", part.content) == tuple(v for row in rows[40:] for v in row[3:23]) and
          part.headers["X-Obscura-View"] == "3,40,20,8,1,max" and part.headers["X-Obscura-Height"] == "8", part.headers)
    for reduce, of in ("max", max), ("mean", lambda bin: (sum(bin) + len(bin) // 2) // len(bin)):
        binned = ask("frame.png", query=f"?bin=5&reduce={reduce}")
        bins = [[rows[y][x] for y in range(v, min(v + 5, HEIGHT)) for x in range(u, min(u + 5, WIDTH))] for v in range(0, HEIGHT, 5) for u in range(0, WIDTH, 5)]
        check(f"bins of 5 pixels: their {reduce}", read_png(binned.content)[0] == tuple(of(bin) for bin in bins) and binned.headers["ETag"] != png.headers["ETag"])
    check("what is no view is refused", {ask("frame.raw", query=f"?{q}").status for q in ("bin=0", "bin=65", "reduce=min", "x=-1", "w=1.5")} == {422} and
          ask("frame.fits", query="?bin=2").status == 422)
    light = until(lambda: ask("frame.exr"), lambda answer: answer.status == 200)  # 503 where rendering takes too long
    pixel = json.loads(until(lambda: ask("probe", query="?x=30&y=20"), lambda answer: answer.status == 200).text)
    image = read_exr(light.content)[0] if light.status == 200 else None
    check("its irradiance is rendered again: that of the probe, bit for bit", light.headers["X-Obscura-Frame"] == known["frame"] and len(image) == WIDTH * HEIGHT and
          image[20 * WIDTH + 30] == struct.unpack("f", struct.pack("f", pixel["irradiance_w_m2"]))[0] > 0, (light.status, light.text[:200] if light.status != 200 else pixel))
    file = folder / "frames" / f"run2_frame_{int(known['frame']):06}.raw"
    check("and are what the daemon wrote", wait_for(lambda: file.exists() and file.stat().st_size == len(raw.content)) and file.read_bytes() == raw.content)
    seen = int(known["id"])

    def newer_than(seen):
        """Number of a frame that is triggered once the camera takes the trigger: a busy chip does not."""
        until(lambda: json.loads(ask("trigger", {}).text), lambda told: told.get("outcome") in ("complete", "late"))
        return int(json.loads(until(lambda: ask("frame.json", query=f"?after={seen}&wait=10"), lambda answer: answer.status == 200).text)["id"])

    for _ in range(3):
        newer = newer_than(seen)
        check("frames never go back", newer > seen)
        seen = newer
    frame_id = known["id"]
    for kind, latest in ("raw", raw), ("png", png), ("fits", fits), ("jpg", jpeg):
        again = ask(f"frame.id.{kind}")
        check(f"an earlier frame is still there by its id, as {kind}", again.content == latest.content and again.headers["ETag"] == latest.headers["ETag"])
    check("and in the form that is wanted, or in part", ask("frame.id", Accept="image/fits").content == fits.content and ask("frame.id", Accept="text/html").status == 406 and
          ask("frame.id.raw", query="?x=3&y=40&w=20&h=30").content == part.content)
    check("its irradiance is too, while the daemon keeps it", until(lambda: ask("frame.id.exr"), lambda answer: answer.status != 503).content == light.content)
    for _ in range(3):
        seen = newer_than(seen)
    check("and then no more", ask("frame.id.exr").status == 409)
    frame_id = "0"
    check("one that is not kept is gone", json.loads(ask("frame.id.fits").text)["type"] == "urn:obscura:gone")
    check("a trigger that is not waited for is answered at once", ask("trigger", {"wait": False}).status == 202)

    asked = ask("trigger", {}, Prefer="wait=5, respond-async")
    check("nor is one whose client prefers that", asked.status == 202 and asked.headers["Preference-Applied"] == "respond-async", asked.headers)

    # Commands that are sent again.
    def sent_again():
        """A key, its command twice, and the one of another token; the chip may be busy with a trigger of before."""
        key = f"k1-{next(numbers)}"
        return key, ask("trigger", {}, Idempotency_Key=key), ask("trigger", {}, Idempotency_Key=key), ask("trigger", {}, role="admin", Idempotency_Key=key)

    numbers = itertools.count()
    key, first, again, other = until(sent_again, lambda told: all(json.loads(answer.text).get("outcome") in ("complete", "late") for answer in told[1:]))
    check("a command that is sent again with its key is answered as before", first.text == again.text and again.headers["Idempotency-Replayed"] == "true" and
          not first.headers["Idempotency-Replayed"], again.text)
    check("and made once: the next frame is that of another token with the same key",
          int(json.loads(other.text)["frame"]) == int(json.loads(first.text)["frame"]) + 1, (first.text, other.text))
    for name, body in ("trigger", {"wait": True}), ("acquisition", {"running": True}):
        refused = ask(name, body, Idempotency_Key=key)
        check(f"{name} {body} with the key of another command is refused", refused.status == 422 and
              json.loads(refused.text)["type"] == "urn:obscura:other-command", refused.text)
    check("so is a key that is none", {ask("trigger", {}, Idempotency_Key=none).status for none in ("", "a b", "k" * 129)} == {422})
    check("what was refused is not kept", ask("features.set", {"Gain": 300}, Idempotency_Key="k2").status == 422 and
          ask("features.set", {"Gain": 5}, Idempotency_Key="k2").status == 200)

    # Values that are refused before a daemon hears of them.
    for name, body in ("acquisition", {}), ("acquisition", {"running": 1}), ("acquisition", {"running": True, "x": 1}), ("trigger", []), ("trigger", {"wait": "x"}), \
            ("scene.show", {"file": 3}), ("faults.set", {"rules": {}}), ("scene.show", {"file": "no such"}), ("scene.show", {"file": "../../etc/passwd"}):
        check(f"{name} {body} is refused", ask(name, body).status == 422)
    for name, query in ("audit", "?after=x"), ("audit", "?after=-1"), ("audit", "?after=1e99"), ("audit", "?x=1"), ("frame.png", "?wait=31"), ("frame.png", "?wait=nan"), \
            ("timing", "?most=0"), ("features.set", "?force=2"):
        check(f"{name}{query} is refused", ask(name, None if name != "features.set" else {}, query=query).status == 422)
    for what, body in ("no JSON", b"{"), ("no UTF-8", b'{"Gain": "\xff"}'), ("a deep body", b'{"Gain": ' + b"[" * 30000 + b"]" * 30000 + b"}"), \
            ("a number that is too large", b'{"Gain": 1e999}'), ("two values", b"{} {}"):
        check(f"{what} is refused", ask("features.set", body).status == 400)
    check("a body of many members is refused", ask("features.set", {f"x{i}": 1 for i in range(3000)}).status == 422)
    check("a camera that is not there", json.loads(ask("features", camera_id="1-1").text)["detail"].endswith(ID) and ask("features", camera_id="%2e%2e").status == 404)

    # Faults.
    armed = ask("faults")
    kind = json.loads(armed.text)["kinds"][0]["name"]
    rule = {"kind": kind, "percent": 1.5}
    told = json.loads(ask("faults.set", {"rules": [rule]}, If_Match=armed.headers["ETag"]).text)
    check("a fault is armed", [{key: r[key] for key in rule} for r in told["rules"]] == [rule], told)
    check("the list with what has struck can be sent back", len(json.loads(ask("faults.set", {"rules": told["rules"]}).text)["rules"]) == 1)
    check("a list that has changed since is not overwritten", ask("faults.set", {"rules": []}, If_Match=armed.headers["ETag"]).status == 412)
    refused = ask("faults.set", {"rules": [rule, {**rule, "percent": 300}]})
    check("a rule that is wrong is named", refused.status == 422 and json.loads(refused.text)["errors"][0]["pointer"] == "#/rules/1/percent", refused.text)
    check("and an empty list disarms", json.loads(ask("faults.set", {"rules": []}).text)["rules"] == [])

    # The GigE Vision side, the scene, the daemon.
    device = {row["name"]: row for row in json.loads(ask("device").text)["features"]}
    check("features of the GigE Vision side", device["TriggerMode[FrameStart]"]["value"] == "On" and device["UserSetLoad"]["type"] == "command")
    check("one of them is written", json.loads(ask("device.set", {"TriggerDivider": 2}).text) == {"written": "TriggerDivider"} and ask("device.set", {"TriggerDivider": 1}).status == 200)
    for body in {}, {"TriggerDivider": 1, "TriggerDelay": 0}, {"TriggerDivider": 0}, {"GevCCP": 1}, {"TriggerDivider": [1]}:
        check(f"{body} is refused", ask("device.set", body).status == 422)
    check("the scene is described", len(json.loads(ask("scene").text)["bodies"]) == 1)
    for name, body in ("step", {"time_s": 1}), ("pose", {"name": "camera", "time_s": 1, "position_m": [0, 0, 1]}):
        check(f"no {name} without a simulator", ask(name, body).status == 409 and ask(name, {}).status == 422)
    check("the log level changes", json.loads(ask("log_level", {"level": "warning"}).text) == {"level": "warning", "before": "info"} and
          ask("log_level", {"level": "loud"}).status == 422 and ask("log_level", {"level": "info"}).status == 200)
    check("the configuration is read again", json.loads(ask("reload", {}, role="admin").text) == {})
    bundle = ask("support-bundle", role="admin")
    with tarfile.open(fileobj=io.BytesIO(zstd(bundle.content))) as archive:
        files = {name.split("/", 1)[1]: archive.extractfile(name).read() for name in archive.getnames()}
    check("the support bundle has what that of the command line has", files.keys() >= {"README.txt", "version.txt", "machine.txt", "state.json", "threads.txt", "events.txt", "configuration.json",
          "camera0-features.json", "camera0-faults.json", "camera0-timing.csv", "self-test.txt"} and b"Missing" not in files["README.txt"], files["README.txt"])
    check("with the machine's lateness, of ordinary scheduling", files["self-test.txt"].startswith(b"ordinary scheduling") and b"99 of 100 rows" in files["self-test.txt"], files["self-test.txt"])
    check("and no frames, no tokens", not any(token.encode() in text for token in tokens.values() for text in files.values()) and not any(name.endswith((".raw", ".png", ".fits")) for name in files))
    check("that of a camera that is not there", ask("support-bundle", role="admin", query="?camera=1-1").status == 404)

    # Another client controls the camera.
    client = GvcpClient(gvcp, PATIENCE_S)
    check("a GigE Vision client takes control", client.write(CONTROL_PRIVILEGE, CONTROL) == 0)
    kept = ask("features.set", {"Gain": 7})
    check("changes are then refused with its address", kept.status == 409 and client.address() in json.loads(kept.text)["detail"] and
          ask("acquisition", {"running": True}).status == 409, kept.text)
    check("and each setting tells who keeps it", wait_for(lambda: json.loads(ask("feature").text)["locked_by"] == f"controlled by {client.address()}"))
    # The daemon gives its own user, which runs this, the permission.
    check("but not those by force", json.loads(ask("features.set", {"Gain": 7}, role="admin", query="?force=true").text) == {"changed": {"Gain": 7.0}})
    if os.geteuid() == 0:
        # As in a service: an account of its own, in the daemon's group and perhaps in control.admin_group.
        folder.chmod(0o750)
        for groups, wanted in ([os.getegid()], 403), ([os.getegid(), ADMINS.gr_gid], 200):
            try:
                other = web_server.Web(web, "--socket", camera.socket, "--role", "admin", user=65534, group=ADMINS.gr_gid + 1, extra_groups=groups)
            except PermissionError:
                print("force of another account was not tried: it cannot run the program here")
                break
            path = f"/api/v1/cameras/{ID}/features?force=true"
            wait_for(lambda: other.ask(path, "PATCH", body={"Gain": 7}).status != 503)
            told = other.ask(path, "PATCH", body={"Gain": 7})
            check(f"force of another account in {len(groups)} groups: {wanted}", told.status == wanted, (told.status, told.text))
            check("it ends well", other.end() == 0)
    check("an admin disconnects the client", json.loads(ask("release", {}, role="admin").text) == {"controller": client.address()} and ask("release", {}).status == 403)
    check("then it does not control it any more", wait_for(lambda: client.write(GAIN, 0) != 0))
    client.write(CONTROL_PRIVILEGE, NO_CONTROL)

    # What only tells.
    rows = json.loads(ask("timing", query="?most=5").text)
    check("instants of the latest frames", rows["columns"][0] == "frame_id" and 0 < len(rows["rows"]) <= 5 and
          {len(row) for row in rows["rows"]} == {len(rows["columns"])}, rows)
    newest = dict(zip(rows["columns"], rows["rows"][-1]))
    told = json.loads(ask("timing.rows", query=f"?frame={newest['frame_id']}").text)
    left = [us for us in told["lateness_us"] if us is not None]
    check("rows of one of them", len(told["lateness_us"]) == newest["rows"] and max(left) == newest["worst_row_ns"] // 1000 and
          told["lateness_us"][newest["worst_row"]] == max(left), (told, newest))
    check("a frame that is not kept is said", ask("timing.rows", query="?frame=123456789").status == 409)
    entries = {entry["key"]: entry for entry in json.loads(ask("configuration").text)["entries"]}
    check("every key says where its value comes from", entries["trigger.rate_hz"]["source"].startswith(str(camera.config)) and
          entries["trigger.rate_hz"]["value"] == "10.0" and entries["daemon.run"]["source"] == "default", entries.get("trigger.rate_hz"))
    printed = subprocess.run([obscurad, "--config", camera.config, "--print-config"], capture_output=True, text=True, check=True).stdout
    wanted = dict(flat("", tomllib.loads(printed)))
    told = {key: tomllib.loads(f"x = {entry['value']}")["x"] for key, entry in entries.items()}
    check("the configuration is that of --print-config, key by key", len(told) > 100 and told == wanted,
          {key: (told.get(key), wanted.get(key)) for key in told.keys() | wanted.keys() if told.get(key) != wanted.get(key)})
    tag = ask("configuration").headers["ETag"]
    check("what is known already of it is not sent again", ask("configuration", If_None_Match=tag).status == 304)
    changed = ask("configuration.set", {"trigger": {"rate_hz": 12.5}, "deadline": {"policy": "drop"}}, role="admin", If_Match=tag)
    again = ask("configuration")
    entries = {entry["key"]: entry for entry in json.loads(again.text)["entries"]}
    check("values of it change together, and say who has changed them", json.loads(changed.text) == {"changed": {"trigger.rate_hz": "12.5", "deadline.policy": '"drop"'}} and
          {(entries[key]["value"], entries[key]["source"]) for key in ("trigger.rate_hz", "deadline.policy")} == {("12.5", "configuration.set"), ('"drop"', "configuration.set")} and
          changed.headers["ETag"] == again.headers["ETag"] != tag, (changed.text, changed.headers, entries["trigger.rate_hz"]))
    check("not if it has changed since", ask("configuration.set", {"trigger": {"rate_hz": 3}}, role="admin", If_Match=tag).status == 412)
    for body, pointer, text in ({"trigger": {"rate_hz": 2e12}, "deadline": {"policy": "late"}}, "#/trigger/rate_hz", "allowed"), ({"deadline": {"policy": "never"}}, "#/deadline/policy", "late"), \
            ({"gige": {"port": 3}}, "#/gige/port", "cannot change while the daemon runs"), ({"scene": {"file": "demo"}}, "#/scene/file", "cannot change"), \
            ({"trigger": {"rate_hx": 3}}, "#/trigger/rate_hx", 'did you mean "trigger.rate_hz"'), ({"trigger": 3}, "#/trigger", "table"), ({}, "#/values", "wanted"):
        refused = ask("configuration.set", body, role="admin")
        error = json.loads(refused.text).get("errors", [{}])[0] if refused.status == 422 else {}
        check(f"{body} is refused with the parser's text, and changes nothing", error.get("pointer") == pointer and text in error["detail"] and
              ask("configuration").headers["ETag"] == again.headers["ETag"], refused.text)
    ask("reload", {}, role="admin")
    check("a reload returns to the file", ask("configuration").headers["ETag"] == tag)
    check("scenes that can be shown", "demo" in json.loads(ask("scenes").text)["scenes"])
    truth = ask("truth")
    check("truth is told, or not known to the daemon", truth.status == 200 or json.loads(truth.text)["type"] in ("urn:obscura:no-call", "urn:obscura:not-now"))

    # The record of changes.
    changes = json.loads(ask("audit", role="viewer").text)["changes"]
    check("each change is recorded: who, what, from what to what", [(c["who"], c["what"], c["before"], c["after"]) for c in changes if c["what"] != "feature.set"][:3] == [
        ("operator operator-1", "features.set", {"Gain": 0.0, "ExposureTime": value["ExposureTime"]}, {"Gain": 3.0, "ExposureTime": 50.0}),
        ("operator operator-1", "features.set", {"Gain": 3.0}, {"Gain": 5.0}), ("operator operator-1", "acquisition", True, False)], changes[:3])
    check("and nothing else is", {c["what"] for c in changes} == {"features.set", "feature.set", "acquisition", "trigger", "faults.set", "device.set", "log_level", "reload", "release", "configuration.set"} and
          [c["id"] for c in changes] == list(range(1, len(changes) + 1)) and all(c["camera"] == ID and c["peer"] == "127.0.0.1" for c in changes))
    check("older ones can be left out", [c["id"] for c in json.loads(ask("audit", query=f"?after={len(changes) - 1}").text)["changes"]] == [len(changes)])

    # Calls that nothing above asks for: the answer, or a refusal for want of fields, is as documented.
    for name in sorted(document.operations.keys() - document.seen):
        method, _, operation = document.operations[name]
        if "x-call" in operation:
            ask(name, None if method == "GET" else {}, role=operation["x-role"])

    # A daemon that does not answer.
    daemon.send_signal(signal.SIGSTOP)
    os.waitpid(daemon.pid, os.WUNTRACED)  # until the last thread has stopped
    waiting = []
    lost = socket.create_connection(("127.0.0.1", server.port), PATIENCE_S)
    body = b'{"running": true}'
    lost.sendall(f"POST /api/v1/cameras/{ID}/acquisition HTTP/1.1\r\nHost: localhost:{server.port}\r\nAuthorization: Bearer {tokens['operator']}\r\n"
                 f"Content-Type: application/json\r\nIdempotency-Key: k3\r\nConnection: close\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body)
    server.ask("/livez")  # read after the command
    progress = None

    def in_progress():
        global progress
        progress = server.ask(f"/api/v1/cameras/{ID}/acquisition", "POST", tokens["operator"], body, Idempotency_Key="k3")
        return progress.status == 409

    check("while a command has no answer, it is not begun again", wait_for(in_progress) and "in-progress" in progress.text and
          progress.headers["Retry-After"] == "1", progress and progress.text)
    for _ in range(6):
        client = socket.create_connection(("127.0.0.1", server.port), PATIENCE_S)
        client.sendall(f"GET /api/v1/cameras/{ID}/features HTTP/1.1\r\nHost: localhost:{server.port}\r\nAuthorization: Bearer {tokens['viewer']}\r\n"
                       "Connection: close\r\n\r\n".encode())
        waiting.append(client)
    check("health, metrics and the document are told meanwhile", server.ask("/livez").status == 200 and
          {server.ask(path, token=tokens["viewer"]).status for path in ("/metrics", "/api/v1/openapi.json", "/api/v1/audit")} == {200})
    answers = [b"".join(iter(lambda client=client: client.recv(65536), b"")) for client in waiting]
    check("its requests end, those beyond the queue at once", all(b" 503 " in a.splitlines()[0] + b" " for a in answers) and
          sum(b"urn:obscura:busy" in a for a in answers) >= 2, answers)
    lost = b"".join(iter(lambda: lost.recv(65536), b""))
    again = server.ask(f"/api/v1/cameras/{ID}/acquisition", "POST", tokens["operator"], body, Idempotency_Key="k3")
    check("a command whose answer was lost may have been made, so it is not made again", b"urn:obscura:answer-lost" in lost and
          again.status == 503 and again.headers["Idempotency-Replayed"] == "true" and again.content in lost, (lost, again.text))
    daemon.send_signal(signal.SIGCONT)
    check("and are answered again once it goes on", wait_for(lambda: server.ask(f"/api/v1/cameras/{ID}/features", token=tokens["viewer"]).status == 200))
    daemon.terminate()
    daemon.wait(PATIENCE_S)
    check("without a daemon there is no camera", wait_for(lambda: server.ask(f"/api/v1/cameras/{ID}/features", token=tokens["viewer"]).status == 503))
    check("every operation was answered as documented", document.seen == document.operations.keys(), document.operations.keys() - document.seen)
    check("it ends well, and its log has the changes", server.end() == 0 and re.findall(r"web: (.*?) at 127.0.0.1: ", server.log) == [c["who"] for c in changes] and
          server.log.count(" by force of camera ") == sum(c["forced"] for c in changes) == 1, server.log[-500:])

    # Without [control].
    camera.config.write_text(camera.config.read_text().split("[control]")[0])
    server = web_server.Web(web, "--socket", camera.socket, "--role", "operator")
    daemon = camera.start()
    closed = wait_for(lambda: server.ask(f"/api/v1/cameras/{daemon.pid}-0/features").status == 503 and
                      "no-control" in server.ask(f"/api/v1/cameras/{daemon.pid}-0/features").text)
    check("a daemon without [control] says so", closed)
    daemon.terminate()
    daemon.wait(PATIENCE_S)
    check("it ends well", server.end() == 0)
if jsonschema is None:
    print("answers were not compared with their schemas: python3-jsonschema is not installed")
sys.exit(1 if failures else 0)
