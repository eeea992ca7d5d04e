#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Models of a running daemon: list, text, check, picture, store, remove; a changed model is a changed scene, and one with mistakes leaves the
old scene as it is. Frames are compared with Lambert's law by numbers.

Usage: model_calls_test.py OBSCURA SOURCE-DIRECTORY OBSCURAD OBSCURA-WEB
Exit status 1 if a check failed, 77 without numpy.
"""
import base64
import json
import os
import pathlib
import signal
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from client_checks import PATIENCE_S, check, check_near, check_refused, end, obscura_client, source, wait_for  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402
from web_server import Web  # noqa: E402

obscurad, web_program = os.path.abspath(sys.argv[3]), sys.argv[4]
LAW = """// A grey law.
parameter albedo {albedo}; //! , 0..1, Albedo
parameter tilt 5; //! deg, 0..30, An angle
vec4 brdf(vec3 $i, vec3 $e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess)
{{
    return diffuse * {value};
}}
"""
LAMBERT = "albedo * max(0, (i | n)) * M_1_PI"


def law(albedo=0.1, value=LAMBERT):
    return LAW.format(albedo=albedo, value=value)


def mean_of(camera):
    """Mean above the offset of a frame that was begun from now on."""
    number = camera.frame().number
    wait_for(lambda: camera.frame().number > number + 3)
    pixels = camera.frame().pixels.astype(float)
    return pixels.mean() - pixels[:8].mean()


def listed(camera):
    return {(model["name"], model["place"]): model for model in camera.call("model.list")["models"]}


def lists_and_texts(camera, folder):
    told = camera.call("model.list")
    check("kinds have names, endings and help", {"name": "material", "ending": ".brdf"}.items() <= told["kinds"][0].items() and told["kinds"][0]["help"], told["kinds"])
    check("folder and scene are told", told["folder"] == str(folder / "models") and told["scene"] == "scene.toml", told)
    rows = listed(camera)
    check("the model of the scene is the first of its name, and used", rows["grey.brdf", "scene"] == {
        "name": "grey.brdf", "kind": "material", "place": "scene", "hidden": False, "used": True, "title": "A grey law."}, rows["grey.brdf", "scene"])
    shipped = sorted(file.name for file in (source / "config/models").iterdir())
    check("all shipped ones are listed", sorted(name for name, place in rows if place == "shipped") == shipped)
    text = camera.call("model.get", file="akimov.brdf")
    check("a text is that of the file", text["text"] == (source / "config/models/akimov.brdf").read_text() and text["place"] == "shipped" and text["kind"] == "material")
    check_refused("a name near another is suggested", "bad-argument", 'did you mean "akimov.brdf"', lambda: camera.call("model.get", file="akimow.brdf"))
    check_refused("a place without it is refused", "bad-argument", "no such model", lambda: camera.call("model.get", file="akimov.brdf", place="folder"))


def checks(camera):
    told = camera.call("model.check", file="x.brdf", text=law(0.25))
    check("a sound text is sound", told["sound"] and told["findings"] == [] and "operations a sample" in told["summary"] and told["kind"] == "material", told)
    check("its cost is told", told["cost"]["operations"] >= 3 and 0 < told["cost"]["ns"] < 500 and told["cost"]["values"] > 0, told["cost"])
    check("parameters are told", told["parameters"][0] == {"name": "albedo", "key": "albedo", "type": "scalar", "global": False, "default": [0.25], "unit": "",
                                                           "min": 0, "max": 1, "help": "Albedo", "line": 2}, told["parameters"])
    check("an angle's key has its unit", told["parameters"][1]["key"] == "tilt_deg" and told["parameters"][1]["unit"] == "deg")
    told = camera.call("model.check", file="x.brdf", text=law(value="muo * (i | n)").replace("return", "scalar q = nothing;\n    return"))
    check("all mistakes are told at their places", [(f["line"], f["column"], f["severity"]) for f in told["findings"]] == [(6, 16, "error"), (7, 22, "error")] and
          "'nothing' is not declared" in told["findings"][0]["what"] and not told["sound"], told["findings"])
    told = camera.call("model.check", file="x.brdf", text=law(value="(1.5 * (i | n) * M_1_PI)"))
    check("a law that reflects too much is warned of", told["sound"] and any(f["severity"] == "warning" and "light" in f["what"] for f in told["findings"]), told)
    told = camera.call("model.check", file="x.brdf", text=law(value="log(-1)"))
    check("a law that is not finite is an error", not told["sound"] and any("finite" in f["what"] for f in told["findings"]), told)
    dear = "".join(f"    x = pow(abs(sin(x + {k})), 0.7);\n" for k in range(400))
    told = camera.call("model.check", file="x.brdf", text=law(value="x").replace("    return", f"    scalar x = (i | n);\n{dear}    return"))
    check("a dear one is refused with its cost", not told["sound"] and any("ns on this machine; allowed are 500" in f["what"] for f in told["findings"]), told["findings"])


def hostile(camera, folder):
    before = sorted(os.listdir(folder / "models")) if (folder / "models").exists() else []
    for name in ("", "x", "../x.brdf", "/tmp/x.brdf", "a/b.brdf", ".brdf", ".x.brdf", "x.toml", "x y.brdf", "x\0.brdf", "x\n.brdf", "ä.brdf", "x" * 65 + ".brdf", "x.brdf/", "x.brdf.tmp"):
        for call, more in ("model.put", {"text": law()}), ("model.check", {"text": law()}), ("model.get", {}), ("model.remove", {}), ("model.plot", {"text": law()}):
            check_refused(f"{call}: the name {name!r:.20} is refused", "bad-argument", "file", lambda: camera.call(call, file=name, **more))
    for what, text, message in (("too long", "/" * 65537, "allowed are 65536"), ("a NUL", "a\0b", "zero byte"), ("no model", "", "brdf"), ("deep", "(" * 60000, "x.brdf:1:"),
                                ("a mistake", law(value="muo"), "x.brdf:6:22: 'muo' is not declared"), ("not text", "\x1b[2J\x07", "x.brdf:1:1")):
        begin = time.monotonic()
        check_refused(f"a text is not stored: {what}", "bad-argument", message, lambda: camera.call("model.put", file="x.brdf", text=text))
        check(f"and quickly: {what}", time.monotonic() - begin < 10)
    after = sorted(os.listdir(folder / "models")) if (folder / "models").exists() else []
    check("nothing was stored", before == after, after)
    check_refused("a form that there is not", "bad-argument", "pictures of this kind are .png, .svg, .csv", lambda: camera.call("model.plot", file="x.brdf", text=law(), form="exe"))
    check_refused("a picture of a text with mistakes", "bad-argument", "x.brdf:6:22", lambda: camera.call("model.plot", file="x.brdf", text=law(value="muo")))


def pictures(camera):
    png = base64.b64decode(camera.call("model.plot", file="x.brdf", text=law(), form="png")["bytes"])
    check("a picture is a PNG", png.startswith(b"\x89PNG\r\n\x1a\n") and len(png) > 1000)
    table = base64.b64decode(camera.call("model.plot", file="x.brdf", text=law(0.3), form="csv")["bytes"]).decode()
    row = dict(zip(table.splitlines()[0].split(","), table.splitlines()[1].split(",")))
    check_near("a table has the law's values", float(row["r_per_sr"]), 0.3 / 3.141592653589793, 1e-12)


def life(camera, folder):
    """A scene whose model is in the folder: other texts, seen in its frames."""
    scene = (folder / "scene.toml").read_text().replace('model = "grey.brdf"', 'model = "own.brdf"')
    (folder / "other.toml").write_text(scene)
    check_refused("a scene without its model is refused", "bad-scene", "own.brdf", lambda: camera.show_scene("other.toml"))
    check("a model is stored", camera.call("model.put", file="own.brdf", text=law(0.1)) == {"file": "own.brdf", "used": False, "replaced": False})
    file = folder / "models" / "own.brdf"
    check("as it was sent", file.read_text() == law(0.1) and sorted(os.listdir(folder / "models")) == ["own.brdf", "pixel.sns"])
    camera.show_scene("other.toml")
    check("then the scene finds it", listed(camera)["own.brdf", "folder"]["used"])
    grey = mean_of(camera)
    told = camera.call("model.put", file="own.brdf", text=law(0.2), show=True)
    check("another text is shown", told == {"file": "own.brdf", "used": True, "replaced": True, "before": law(0.1)}, told)
    bright = mean_of(camera)
    check_near("frames are twice as bright", bright / grey, 2, 0.25)
    # A text that is sound by itself, and not with the scene's keys.
    (folder / "other.toml").write_text(scene.replace('model = "own.brdf"', 'model = "own.brdf", albedo = 0.2'))
    check_refused("a text that the scene cannot use is refused with the place", "bad-scene", "other.toml:", lambda: camera.call(
        "model.put", file="own.brdf", text=law(0.3).replace("albedo", "whiteness"), show=True))
    check("the model before is back", file.read_text() == law(0.2))
    check_near("and frames stay", mean_of(camera) / bright, 1, 0.25)
    check_refused("a model in use is not removed", "not-now", "the scene that is shown names it", lambda: camera.call("model.remove", file="own.brdf"))
    check_refused("nor with show, where no other has its name", "bad-scene", "own.brdf", lambda: camera.call("model.remove", file="own.brdf", show=True))
    check("it is still there", file.read_text() == law(0.2))
    check("the model of the sensor is in use", listed(camera)["pixel.sns", "folder"]["used"] and not listed(camera)["lin-log.sns", "shipped"]["used"])
    check_refused("and stays", "not-now", "pixel.sns: a sensor has it", lambda: camera.call("model.remove", file="pixel.sns", show=True))
    # A shipped model gives way to one of the folder.
    (folder / "other.toml").write_text((folder / "scene.toml").read_text().replace('model = "grey.brdf"', 'model = "lambert"'))
    camera.show_scene("other.toml")
    shipped = mean_of(camera)
    camera.call("model.put", file="lambert.brdf", text=law(0.5), show=True)
    rows = listed(camera)
    check("the one of the folder hides the shipped one", rows["lambert.brdf", "folder"]["used"] and rows["lambert.brdf", "shipped"]["hidden"] and not rows["lambert.brdf", "shipped"]["used"])
    own = mean_of(camera)
    check("frames use it", abs(own / shipped - 1) > 0.5, (own, shipped))
    check("and removing it shows the shipped one", camera.call("model.remove", file="lambert.brdf", show=True) == {"before": law(0.5)})
    check_near("in frames, too", mean_of(camera) / shipped, 1, 0.25)
    check_refused("a shipped one is not removed", "bad-argument", "no such model in the folder", lambda: camera.call("model.remove", file="lambert.brdf", show=True))
    check_refused("a name beside the scene is not stored", "bad-argument", "stands beside the scene", lambda: camera.call("model.put", file="grey.brdf", text=law()))
    for number in range(2, 256):
        (folder / "models" / f"m{number}.brdf").write_text("//")
    check_refused("too many are refused", "too-large", "257 files", lambda: camera.call("model.put", file="x.brdf", text=law()))
    for number in range(2, 256):
        (folder / "models" / f"m{number}.brdf").unlink()
    for number in range(70):
        (folder / "models" / f"m{number}.brdf").write_bytes(b"/" * 65000)
    check_refused("too large ones are refused", "too-large", "bytes: allowed are", lambda: camera.call("model.put", file="x.brdf", text=law()))
    for number in range(70):
        (folder / "models" / f"m{number}.brdf").unlink()
    camera.show_scene("scene.toml")


def reload(camera, daemon, folder):
    """SIGHUP and the call, with a model beside the scene."""
    last = lambda: camera.events()[-1]["text"]
    before = mean_of(camera)
    (folder / "grey.brdf").write_text(law(0.3))
    daemon.send_signal(signal.SIGHUP)
    wait_for(lambda: "taken on" in last())
    bright = mean_of(camera)
    check_near("SIGHUP takes another text", bright / before, 3, 0.25)
    (folder / "grey.brdf").write_text(law(0.9, "muo"))
    daemon.send_signal(signal.SIGHUP)
    wait_for(lambda: "nothing changed" in last())
    line = f"{folder}/grey.brdf:6:22: 'muo' is not declared"
    check("a bad text is told in the log", line in last(), last())
    check_near("and the old scene stays", mean_of(camera) / bright, 1, 0.25)
    check_refused("the call says it, too", "not-now", line, lambda: camera.call("reload"))
    check_refused("as does scene.show", "bad-scene", line, lambda: camera.show_scene("scene.toml"))
    (folder / "grey.brdf").write_text(law(0.1))
    camera.call("reload")
    check_near("a good one is taken again", mean_of(camera) / before, 1, 0.25)
    check("frames did not fail", not any("rendering fails" in event["text"] for event in camera.events()))


def over_http(folder, small):
    web = Web(web_program, "--role", "operator", "--socket", small.socket)
    try:
        wait_for(lambda: json.loads(web.ask("/api/v1/cameras").text)["cameras"])
        camera = json.loads(web.ask("/api/v1/cameras").text)["cameras"][0]["id"]
        path = f"/api/v1/cameras/{camera}/models"
        check("HTTP: list", any(m["name"] == "grey.brdf" for m in json.loads(web.ask(path).text)["models"]))
        check("HTTP: text", json.loads(web.ask(path + "/text?file=grey.brdf").text)["place"] == "scene")
        told = json.loads(web.ask(path + "/check", "POST", body={"file": "x.brdf", "text": law(value="muo")}).text)
        check("HTTP: check", told["findings"][0]["line"] == 6, told)
        check("HTTP: picture", base64.b64decode(json.loads(web.ask(path + "/plot", "POST", body={"file": "x.brdf", "text": law(), "form": "png"}).text)["bytes"])[1:4] == b"PNG")
        long_text = law() + "// " + "\n" * 60000
        check("HTTP: store", web.ask(path, "PUT", body={"file": "web.brdf", "text": long_text}).status == 200 and (folder / "models/web.brdf").read_text() == long_text)
        audit = json.loads(web.ask("/api/v1/audit").text)
        check("HTTP: a change is on record, without its text", "web.brdf" in json.dumps(audit) and len(json.dumps(audit)) < 5000 and "model.check" not in json.dumps(audit), audit)
        check("HTTP: remove", web.ask(path + "/remove", "POST", body={"file": "web.brdf"}).status == 200 and not (folder / "models/web.brdf").exists())
        refused = web.ask(path, "PUT", body={"file": "../x.brdf", "text": law()})
        check("HTTP: a hostile name is refused", refused.status in (400, 422) and "no folders" in refused.text, (refused.status, refused.text))
    finally:
        web.end()


with tempfile.TemporaryDirectory(prefix="obscura-model-calls-") as temporary:
    folder = pathlib.Path(temporary)
    folder.chmod(0o755)
    small = SmallDaemon(folder, obscurad, source, tables=f'[control]\nunix_socket = "{folder}/calls"\nscenes = "{folder}"\n[models]\nfolder = "{folder}/models"\n[sensor]\nmodel = {{ model = "pixel" }}\n')
    (folder / "models").mkdir()
    (folder / "models/pixel.sns").write_text("scalar convert(scalar signal, scalar x, scalar y) { return signal; }\n")
    (folder / "grey.brdf").write_text(law())
    text = (folder / "scene.toml").read_text()
    for old, new in ("albedo = 0.1", 'material = { model = "grey.brdf" }'), ("-20000", "-400000"), ("distance_au = 2", "distance_au = 60"):
        text = text.replace(old, new)
    (folder / "scene.toml").write_text(text)
    daemon = small.start("--ready-file", folder / "ready")
    try:
        wait_for(lambda: (folder / "ready").exists())
        with obscura_client.connect_camera(str(folder / "calls"), timeout_s=PATIENCE_S) as camera:
            lists_and_texts(camera, folder)
            checks(camera)
            hostile(camera, folder)
            pictures(camera)
            life(camera, folder)
            reload(camera, daemon, folder)
            over_http(folder, small)
    finally:
        daemon.terminate()
        daemon.wait(PATIENCE_S)
sys.exit(end())
