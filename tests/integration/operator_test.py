#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The verbs of obscura that call a running daemon: values and frames are those of the Python client, refusals have one line and
an exit status of their own, and an answer of a hostile daemon does no harm.

Usage: operator_test.py OBSCURA SOURCE-DIRECTORY OBSCURAD OBSCURA-WEB
Exit status 1 if a check failed, 77 without numpy.
"""
import io
import json
import os
import pathlib
import random
import shutil
import socket
import struct
import subprocess
import sys
import tarfile
import tempfile
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from client_checks import PATIENCE_S, check, end, obscura, obscura_client, source, wait_for  # noqa: E402
from gvcp_client import CONTROL, CONTROL_PRIVILEGE, NO_CONTROL, GvcpClient  # noqa: E402
from obscura_client import protocol  # noqa: E402
from obscura_client.messagepack import pack  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402
from web_server import Web  # noqa: E402
from zstd_frame import zstd  # noqa: E402

obscurad, obscura_web = (os.path.abspath(program) for program in sys.argv[3:5])
NO_DAEMON, CONTROLLED, NOT_ALLOWED, REFUSED = 69, 75, 77, 78


class Verbs:
    """Runs verbs with options that say which daemon."""

    def __init__(self, *options):
        self.options = options

    def __call__(self, *words):
        return subprocess.run([obscura, *words, *self.options], capture_output=True, text=True, timeout=PATIENCE_S)

    def json(self, *words):
        done = self(*words, "--json")
        return [json.loads(line) for line in done.stdout.splitlines()]

    def check_refused(self, what, status, message, *words):
        done = self(*words)
        check(what, done.returncode == status and message in done.stderr and done.stderr.count("\n") == 1 and
              done.stderr.startswith("obscura "), done)


def settings(run, camera):
    everything = camera.get()
    check("get prints what the client gets", run.json("get")[0] == everything)
    check("one setting alone", run("get", "ExposureTime").stdout == f"{everything['ExposureTime']:g}\n")
    several = run("get", "Width", "TriggerMode").stdout
    check("several as lines that set takes", several == f"Width={everything['Width']}\nTriggerMode=On\n", several)
    check("set prints all that has changed", run.json("set", "ExposureTime=2500", "Gain=0")[0] == {"ExposureTime": 2500} and
          camera.get("ExposureTime") == 2500)
    check("texts and truths are set as such", run("set", "TestPattern=FrameCounter", "AcquisitionFrameRateEnable=false").returncode == 0 and
          camera.get("TestPattern", "AcquisitionFrameRateEnable") == {"TestPattern": "FrameCounter", "AcquisitionFrameRateEnable": False})
    check("what stands already is said", run("set", "TestPattern=FrameCounter").stdout.startswith("nothing has changed"))
    run("set", "TestPattern=Off")
    run.check_refused("a value out of range", REFUSED, "Gain: 99 is out of range, allowed 0 to", "set", "Gain=99", "ExposureTime=7")
    check("and nothing of that request holds", camera.get("ExposureTime") == 2500)
    run.check_refused("a number that is a text", REFUSED, "Gain", "set", "Gain=lots")
    run.check_refused("an unknown setting", REFUSED, 'did you mean "Gain"', "set", "Gian=1")
    run.check_refused("an unknown setting to read", REFUSED, 'did you mean "Gain"', "get", "Gian")
    Verbs().check_refused("an option without its value", 64, "--camera needs a value, N (0 to 1000)", "get", "--camera")
    run.check_refused("a word that sets nothing", 64, "is not NAME=VALUE", "set", "Gain")
    run.check_refused("a setting given twice", 64, "given twice", "set", "Gain=1", "Gain=2")
    run.check_refused("a camera that is not there", REFUSED, "there is no camera 1", "get", "--camera", "1")

    rows = {row["name"]: row for row in camera.features()}
    check("features are those of the client", {row["name"]: row for row in run.json("features")[0]} == rows)
    lines = {line.split()[0]: line for line in run("features").stdout.splitlines()}
    check("the table has value, unit, access and range", lines["ExposureTime"].split()[1:4] == ["2500", "us", "rw"] and
          lines["ExposureTime"].endswith(rows["ExposureTime"]["allowed"]), lines["ExposureTime"])
    check("a part of the name chooses", {row["name"] for row in run.json("features", "exposure")[0]} ==
          {name for name in rows if name.startswith("Exposure")})
    check("with their meaning", rows["Gain"]["help"] in run("features", "gain", "--long").stdout)
    run.check_refused("a category that is not there", REFUSED, 'did you mean "Gain"', "features", "Gian")


def acquisition_and_triggers(run, camera):
    check("the acquisition starts once", [run("start").stdout, run("start").stdout] ==
          ["the camera acquires\n", "the camera acquired already\n"])
    run.check_refused("the image keeps its size meanwhile", 1, "(try: obscura stop)", "set", "Width=32")
    check("features say why", " ro: " in next(line for line in run("features").stdout.splitlines() if line.startswith("Width ")))
    run.check_refused("no trigger of another source", 1, "TriggerSource Line0, not On and Software (try: obscura set", "trigger")
    check("the source changes", run("set", "TriggerSource=Software").returncode == 0)
    wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"])
    first = run("trigger")
    frame = camera.state()["cameras"][0]["frame_id"]
    check("a trigger tells of its frame", first.stdout.startswith(f"frame {frame}: ") and " late rows, " in first.stdout, first)
    wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"])
    several = run.json("trigger", "--frames", "3")
    check("several follow one another", [one["frame"] for one in several] == [frame + 1, frame + 2, frame + 3], several)
    wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"])
    run.check_refused("datagrams go to a daemon that listens for them", NO_DAEMON, "127.0.0.1:9: ", "trigger", "--udp", "127.0.0.1:9")


def frames(run, camera, folder):
    last = camera.state()["cameras"][0]["frame_id"]
    kept = run("frame", "--wait", "0.1", "-o", folder / "kept.png")
    check("the last frame is kept for whoever asks later", f": frame {last}, " in kept.stdout and (folder / "kept.png").exists(), kept)
    wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"])
    saver = threading.Thread(target=lambda: run("frame", "latest", "-o", folder / "one.raw"))
    watched = []
    watcher = threading.Thread(target=lambda: watched.append(camera.frame()))
    saver.start(), watcher.start()
    with obscura_client.connect_camera(run.options[1]) as other:
        while saver.is_alive() or watcher.is_alive():  # until both have looked
            other.trigger()
            saver.join(0.2), watcher.join(0.2)
    run("set", "TriggerSource=Line0")
    newest = camera.frame(camera.frame().number)
    said = run.json("frame", "-n", "3", "-o", f"{folder}/several/", "--format", "raw")
    check("several go on without a gap of their own", [one["skipped"] for one in said[1:]] ==
          [b["number"] - a["number"] - 1 for a, b in zip(said, said[1:])] and said[0]["number"] >= newest.number, said)
    run("set", "TriggerSource=Software", "TestPattern=GreyHorizontalRamp")
    run("stop"), run("start")
    for suffix in ("png", "fits", "raw"):
        wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"])
        results = []
        saver = threading.Thread(target=lambda s=suffix: results.extend(run.json("frame", "-o", folder / f"same.{s}")))
        saver.start()
        while saver.is_alive():
            with obscura_client.connect_camera(run.options[1]) as other:
                other.trigger()
            saver.join(0.3)
        # Further triggers may have made newer frames.
        _, arrays = camera._connection.request("frame", {"number": results[0]["number"]})
        expected = folder / "expected"
        expected.write_bytes(arrays["pixels"].astype("<u2").tobytes())
        if suffix == "raw":
            same = (folder / "same.raw").read_bytes() == expected.read_bytes()
            cards = (folder / "same.toml").read_text()
            check("metadata stand beside raw frames", f"FRAMEID = {results[0]['frame']} " in cards and "EXPOSURE = 0.0025 " in cards and
                  f"T_EDGE = {results[0]['edge_tai_ns']} " in cards, cards)
        else:
            reader = subprocess.run([sys.executable, source / "tests" / "support" / "read_image.py", folder / f"same.{suffix}", expected,
                                     f"FRAMEID={results[0]['frame']}"], capture_output=True, text=True)
            same = reader.returncode == 0 or reader.stdout + reader.stderr
        check(f"{suffix} has the pixels that the client gets", same is True, same)
    known = run.json("frame", "-o", folder / "known.json")[0]
    told = json.loads((folder / "known.json").read_text())
    check("metadata alone are JSON", {**told, "file": known["file"]} == known and told["width"] == 64, (told, known))
    again = run.json("frame", str(told["number"]), "-o", folder / "again.raw")[0]
    check("a frame is there again by its number", again["frame"] == told["frame"] and again["edge_tai_ns"] == told["edge_tai_ns"] and
          (folder / "again.raw").read_bytes() == camera.frame().pixels.astype("<u2").tobytes(), (again, told))
    run.check_refused("one that has gone is not", 1, "is not there any more", "frame", "1", "-o", folder / "x.png")
    run.check_refused("nor is a word", 64, "allowed are latest and the number", "frame", "first", "-o", folder / "x.png")
    run.check_refused("several frames want a folder", 64, "a folder is wanted", "frame", "-n", "2", "-o", folder / "x.png")
    run.check_refused("another suffix", 64, "allowed are files ending in .png, .fits, .raw, .json", "frame", "-o", folder / "x.jpg")
    run.check_refused("nor a folder that is not there, before a frame is waited for", 64, f"there is no folder {folder}/none", "frame", "-o", folder / "none/x.png", "--wait", "60")


def bundle(run, folder, controlled):
    file = folder / "b.tar.zst"
    done = run("support-bundle", "-o", file)
    check("the bundle is for its owner only", file.stat().st_mode & 0o777 == 0o600, oct(file.stat().st_mode))
    with tarfile.open(fileobj=io.BytesIO(zstd(file.read_bytes()))) as archive:
        files = {pathlib.Path(member.name).name: archive.extractfile(member).read().decode() for member in archive.getmembers()}
    check("it lists what it has", all(name in files["README.txt"] for name in files if name != "README.txt") and
          done.stdout.startswith(f"{file}: {len(files)} files\n"), files.keys())
    check("kernel and machine are in it", pathlib.Path("/proc/cmdline").read_text().split()[0] in files["machine.txt"])
    check("state and log, too" if controlled else "state and log, also without calls",
          json.loads(files["state.json"])["daemon"]["pid"] > 0 and "monitor: " in files["events.txt"] and
          "main" not in files["threads.txt"].splitlines()[0], files.keys())
    return files, done


def controlled_by_another(run, camera, port):
    client = GvcpClient(port, PATIENCE_S)
    check("a GigE Vision client takes control", client.write(CONTROL_PRIVILEGE, CONTROL) == 0)
    why = f"controlled by {client.address()}"
    for words in (["set", "Gain=6"], ["start"], ["stop"], ["trigger"]):
        run.check_refused(f"then {words[0]} is refused", CONTROLLED, why, *words)
    told = run("features", "gain")
    check("but features may be looked at, and tell", told.returncode == 0 and why in told.stdout, told)
    check("it leaves", client.write(CONTROL_PRIVILEGE, NO_CONTROL) == 0)
    check("and the camera is open again", run("set", "Gain=6").stdout == "Gain=6\n" and camera.get("Gain") == 6)


def every_verb_over_the_web(run, camera, folder, monitor):
    """Verbs that have not been asked yet: each does what it does without --url."""
    local = Verbs("--socket", monitor)
    state = run.json("status")[0]
    check("status", state["daemon"] == {**local.json("status")[0]["daemon"], **{k: state["daemon"][k] for k in ("up_s", "resident_mib", "locked_mib", "log_lines")}} and
          "trigger to first row" in run("status").stdout, state["daemon"])
    told = run("status", "--json")  # whose verdict is that of its own moment
    bad = "bad" in [camera["verdict"]["health"] for camera in json.loads(told.stdout)["cameras"]]
    check("its exit status is that of the verdict", told.returncode == (1 if bad else 0), told)
    texts = [event["text"] for event in run.json("events")]
    check("events", any(text.startswith("monitor: ") for text in texts) and set(texts) <= {event["text"] for event in local.json("events")}, texts[:9])
    check("features of a part of the name", [row["name"] for row in run.json("features", "gain")[0]] == ["Gain", "GainAuto"] or
          "Gain" in run("features", "gain").stdout)
    camera.set(TriggerSource="Software")
    wait_for(lambda: camera.state()["cameras"][0]["trigger_ready"])
    before = camera.state()["cameras"][0]["frame_id"]
    fired = run.json("trigger")[0]
    check("trigger", fired["frame"] == before + 1 and fired["outcome"] in ("complete", "late"), fired)
    camera.set(TriggerSource="Line0")
    check("scene list", run("scene", "list").stdout == local("scene", "list").stdout != "")
    run.check_refused("scene show", REFUSED, "no such file", "scene", "show", "nothing.toml")
    check("fault add", "percent=2" in run("fault", "add", "lose", "percent=2").stdout and camera.faults()[0]["percent"] == 2, camera.faults())
    check("fault list", run.json("fault", "list")[0]["rules"] == local.json("fault", "list")[0]["rules"])
    run.check_refused("a parameter of a fault out of range", REFUSED, "percent", "fault", "add", "lose", "percent=101")
    check("fault clear", run("fault", "clear").stdout == "no faults\n" and not camera.faults())
    said = run.json("frame", "-o", folder / "web.json")[0]
    check("frame as JSON", json.loads((folder / "web.json").read_text())["frame"] == said["frame"], said)
    saved = run("support-bundle", "-o", folder / "web.tar.zst")
    check("support-bundle", saved.stdout.startswith(f"{folder / 'web.tar.zst'}: ") and "missing: calls" not in saved.stdout, saved)
    run.check_refused("--url excludes --socket", 64, "excludes", "status", "--socket", monitor)


def over_the_web(camera, folder, monitor):
    """The same through obscura-web, with a token, over HTTP and HTTPS."""
    check("without a server there is no link", Verbs()("web").returncode == NO_DAEMON)
    check("verbs of two words have a help", "scene show" in Verbs()("scene", "--help").stdout and Verbs()("fault", "-h").returncode == 0)
    server = Web(obscura_web, "--socket", monitor, "--role", "operator")
    # A file that a killed server has left: its number may be that of any process now, here of this test.
    left = pathlib.Path(os.environ["XDG_RUNTIME_DIR"]) / "obscura" / f"obscura-web-{os.getpid()}.link"
    left.write_text("http://127.0.0.1:1/#token=old\n")
    check("the link is found", wait_for(lambda: Verbs()("web").stdout == server.link + "\n"), server.link)
    run = Verbs("--url", server.link)
    wait_for(lambda: run("get", "Gain").returncode == 0)  # once it has asked the daemon
    check("get prints what the client gets", run.json("get")[0] == camera.get(), run("get"))
    check("set prints what has changed", run.json("set", "ExposureTime=3000")[0] == {"ExposureTime": 3000} and
          camera.get("ExposureTime") == 3000)
    run.check_refused("a value out of range", REFUSED, "Gain: 99 is out of range, allowed 0 to", "set", "Gain=99")
    check("features are those of the client", [row["name"] for row in run.json("features")[0]] == [row["name"] for row in camera.features()])
    camera.start()
    check("the acquisition stops and starts", [run("stop").stdout, run("start").stdout] == ["the camera has stopped\n", "the camera acquires\n"])
    camera.set(TriggerSource="Line0")
    said = run.json("frame", "-o", folder / "web.raw")[0]
    check("a frame has its metadata and its pixels", (folder / "web.raw").stat().st_size == 2 * said["width"] * said["height"] and
          f"FRAMEID = {said['frame']} " in (folder / "web.toml").read_text(), said)
    every_verb_over_the_web(run, camera, folder, monitor)
    run.check_refused("a role that may not", NOT_ALLOWED, "admin", "set", "Gain=3", "--force")
    Verbs("--url", server.link[:-3] + "xxx").check_refused("a wrong token", NOT_ALLOWED, "this token is not known (--token-file", "get")
    # 0.0.0.0 reaches this machine, too, but is no name of its loopback interface.
    told = Verbs("--url", server.link.replace("127.0.0.1", "0.0.0.0"))("get", "Gain")
    check("a token in the clear is warned of, in one line", told.stderr.splitlines()[0].startswith("obscura get: warning: the token crosses the network"),
          told)
    check("but not on the loopback interface", "warning" not in run("get", "Gain").stderr)
    Verbs("--url", "ftp://x").check_refused("another protocol", 64, "allowed are https://", "get")
    Verbs("--url", f"https://127.0.0.1:{server.port}").check_refused("HTTP is not taken for HTTPS", NO_DAEMON, "", "get")
    server.process.terminate()
    server.process.wait(PATIENCE_S)
    Verbs("--url", server.link).check_refused("a server that has gone", NO_DAEMON, "", "get")
    if not shutil.which("openssl"):
        return
    certificate, key = folder / "crt", folder / "key"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj", "/CN=localhost",
                    "-addext", "subjectAltName=DNS:localhost", "-out", certificate, "-keyout", key], capture_output=True, check=True)
    server = Web(obscura_web, "--socket", monitor, "--tls-certificate", certificate, "--tls-key", key)
    os.environ["OBSCURA_TOKEN"] = server.token
    trusting = Verbs("--url", f"https://localhost:{server.port}", "--cacert", str(certificate))
    check("over TLS with the token of the environment", wait_for(lambda: trusting("get", "Gain").returncode == 0), trusting("get", "Gain"))
    for words in (["status"], ["events"], ["get"], ["features"], ["scene", "list"], ["fault", "list"], ["frame", "-o", folder / "tls.png"],
                  ["support-bundle", "-o", folder / "tls.tar.zst"]):
        done = trusting(*words)
        check(f"{words[0]} over TLS", done.returncode in (0, 1) and "warning" not in done.stderr and done.stdout != "", done)
    for words in (["set", "Gain=1"], ["start"], ["stop"], ["trigger"], ["fault", "clear"], ["scene", "show", "scene.toml"]):
        trusting.check_refused(f"{words[0]} over TLS with a viewer's token", NOT_ALLOWED, "operator", *words)
    for what, options in (("a certificate of nobody known", ["--url", f"https://localhost:{server.port}"]),
                          ("a certificate of another name", ["--url", f"https://127.0.0.1:{server.port}", "--cacert", str(certificate)])):
        Verbs(*options).check_refused(what, NO_DAEMON, "", "get")
    server.process.terminate()
    server.process.wait(PATIENCE_S)


def hostile_daemon(folder):
    """Answers of a server that follows no rule: each verb ends with one line."""
    path = str(folder / "hostile")
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(path)
    listener.listen(4)
    dice = random.Random(18)

    def message(number, head, body=b"", kind=protocol.ANSWER, length=None):
        head = head if isinstance(head, bytes) else pack(head)
        return struct.pack("<4sBBHIIQ", b"OBSC", 1, kind, 0, number, len(head), len(body) if length is None else length) + head + body

    pixels = {"name": "pixels", "dtype": "<u2", "shape": [2, 2], "codec": "none", "offset": 0, "bytes": 8}
    escape = "\x1b[31mred\x07"
    answers = {
        "no map": lambda n: message(n, [1, 2]),
        "other types": lambda n: message(n, {"values": 7, "changed": [1], "features": {"a": 1}, "number": "x", "frame": [], "rules": 3}),
        "nothing in it": lambda n: message(n, {}),
        "a body of 2^60 bytes": lambda n: message(n, {}, length=1 << 60),
        "a shape that is not that of the bytes": lambda n: message(n, {"arrays": [dict(pixels, shape=[1 << 31, 1 << 31])]}, bytes(8)),
        "negative and huge numbers": lambda n: message(n, {"number": -5, "frame": 2**62, "bits": 10**9, "rows": -1, "skipped": 0,
                                                           "arrays": [pixels]}, bytes(8)),
        "escape sequences": lambda n: message(n, {"code": "bad-argument", "message": escape, "hint": escape}, kind=protocol.ERROR),
        "noise": lambda n: dice.randbytes(5000),
        "the end": lambda n: b"",
    }
    current = [None]

    def serve():
        while True:
            client, _ = listener.accept()
            with client:
                try:
                    while True:
                        head = protocol.frame(client.recv(24, socket.MSG_WAITALL))
                        client.recv(head.head_bytes, socket.MSG_WAITALL)
                        if head.number == 1:
                            client.sendall(message(1, {"server": "obscura", "permission": "admin", "limits": {}, "codecs": []}))
                            continue
                        answer = answers[current[0]](head.number)
                        client.sendall(answer)
                        if not answer:
                            break
                except (OSError, struct.error):
                    pass

    threading.Thread(target=serve, daemon=True).start()
    run = Verbs("--control", path)
    for what in answers:
        current[0] = what
        bad = []
        for words in (["get"], ["set", "Gain=1"], ["features"], ["trigger"], ["frame", "-o", str(folder / "h.png")], ["fault", "list"]):
            done = run(*words)
            if done.returncode not in (0, 1, NO_DAEMON, REFUSED) or done.stderr.count("\n") > 1 or "\x1b" in done.stdout + done.stderr or \
                    len(done.stdout) > 1000:
                bad.append(done)
        check(f"a daemon that answers {what} does no harm", not bad, bad)


with tempfile.TemporaryDirectory(prefix="obscura-operator-") as temporary:
    root = pathlib.Path(temporary)
    none = Verbs("--socket", str(root / "nothing"))("get")
    check("without a daemon the status is 69, in one line", none.returncode == NO_DAEMON and none.stderr.count("\n") == 1, none)
    Verbs("--control", str(root / "nothing")).check_refused("also without a socket for calls", NO_DAEMON, "No such file", "get")

    (root / "runtime" / "obscura").mkdir(parents=True, mode=0o700)
    os.environ["XDG_RUNTIME_DIR"] = str(root / "runtime")
    hostile_daemon(root)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        gvcp = probe.getsockname()[1]
    calls = str(root / "calls")
    daemon = SmallDaemon(root, obscurad, source, tables=f'[control]\nunix_socket = "{calls}"\n')
    daemon.config.write_text(daemon.config.read_text().replace(
        "[gige]\nenabled = false", f'[gige]\nenabled = true\ninterface = "127.0.0.1"\nport = {gvcp}'))
    process = daemon.start("--ready-file", root / "ready")
    check("the daemon starts", wait_for((root / "ready").exists))
    by_address, by_monitor = Verbs("--control", calls), Verbs("--socket", daemon.socket)
    with obscura_client.connect_camera(calls, timeout_s=PATIENCE_S) as one:
        check("the daemon is found by its monitor", by_monitor("get", "Gain").stdout == "0\n", by_monitor("get", "Gain"))
        settings(by_address, one)
        acquisition_and_triggers(by_address, one)
        frames(by_address, one, root)
        controlled_by_another(by_address, one, gvcp)
        check("scenes can be listed", "* scene.toml" in by_address("scene", "list").stdout, by_address("scene", "list"))
        over_the_web(one, root, daemon.socket)
        by_address.check_refused("a scene that is not there", REFUSED, "no such file", "scene", "show", "nothing.toml")
        check("faults are added", "percent=1" in by_address("fault", "add", "lose", "percent=1").stdout)
        rules = by_address.json("fault", "list")[0]["rules"]
        check("and listed", [rule["kind"] for rule in rules] == ["lose"] and rules[0]["percent"] == 1, rules)
        by_address.check_refused("a parameter out of range", REFUSED, "percent", "fault", "add", "lose", "percent=101")
        check("and cleared", by_address("fault", "clear").stdout == "no faults\n" and not by_address.json("fault", "list")[0]["rules"])
        saved, said = bundle(by_monitor, root, True)
        check("nothing is missing in it", said.returncode == 0 and "missing" not in said.stdout, said)
        check("the self-test disturbs no camera", saved["self-test.txt"].startswith("ordinary scheduling"), saved["self-test.txt"])
        entries = {entry["key"]: entry for entry in json.loads(saved["configuration.json"])["entries"]}
        check("the configuration has its sources", entries["trigger.rate_hz"]["value"].startswith("10") and
              entries["trigger.rate_hz"]["source"].startswith(str(daemon.config)), entries["trigger.rate_hz"])
        check("the timing has frames", len(saved["camera0-timing.csv"].splitlines()) > 3)
    if os.geteuid() == 0:
        nobody = subprocess.run([obscura, "get", "--control", calls], capture_output=True, text=True, user=65534, group=65534, extra_groups=[])
        check("others may not", nobody.returncode == NOT_ALLOWED and nobody.stderr.count("\n") == 1, nobody)
    process.terminate()
    check("the daemon ends well", process.wait(PATIENCE_S) == 0)

    daemon.config.write_text(daemon.config.read_text().replace("[gige]\nenabled = true", "[gige]\nenabled = false"))
    (root / "ready").unlink()
    process = daemon.start("--ready-file", root / "ready")
    check("it starts without GigE Vision", wait_for((root / "ready").exists))
    saved, said = bundle(by_monitor, root, True)
    check("nothing that such a camera has is missing in the bundle", said.returncode == 0 and "missing" not in said.stdout and "camera0-features.json" in saved, said)
    process.terminate()
    process.wait(PATIENCE_S)

    daemon.config.write_text(daemon.config.read_text().replace(f'[control]\nunix_socket = "{calls}"\n', ""))
    (root / "ready").unlink()
    process = daemon.start("--ready-file", root / "ready")
    check("it starts without calls", wait_for((root / "ready").exists))
    by_monitor.check_refused("then a verb says what is to be set", NO_DAEMON,
                             f"the daemon takes no calls: set control.unix_socket in {daemon.config}", "get")
    saved, said = bundle(by_monitor, root, False)
    check("the rest of a bundle is there", "configuration.json" not in saved and "missing: calls of the daemon: " in said.stdout, said)
    process.terminate()
    process.wait(PATIENCE_S)

sys.exit(end())
