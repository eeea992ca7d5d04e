#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Calls and state that the operator's screens need: features of the GigE Vision side against its registers, user sets, what the sensor
makes of settings, the scene's description, the number of the stream's frame, release, reload, log level, threads and heartbeats.

Usage: daemon_calls_test.py OBSCURA SOURCE-DIRECTORY OBSCURAD
Exit status 1 if a check failed, 77 without numpy.
"""
import math
import os
import pathlib
import re
import signal
import socket
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from client_checks import PATIENCE_S, check, check_near, check_refused, end, obscura_client, source, wait_for  # noqa: E402
from gvcp_client import CONTROL, CONTROL_PRIVILEGE, GvcpClient  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

obscurad = os.path.abspath(sys.argv[3])
STREAM_ADDRESS, STREAM_PORT, PACKET_SIZE, ACQUISITION_START, GAIN = 0xD18, 0xD00, 0xD04, 0xA104, 0xA160


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def documented():
    """Whole words of docs/reference/features.md: {name: (type, address)}, without those of several items, and without bits of words."""
    rows = {}
    for line in (source / "docs/reference/features.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.split(" | ")]
        if len(cells) == 10 and re.fullmatch("0x[0-9A-F]{4}", cells[8]):
            rows[cells[0].lstrip("| ").replace("*", "").split("[")[0]] = (cells[1], int(cells[8], 16))
    return rows


def features_and_registers(camera, client):
    rows = {row["name"]: row for row in camera.call("device.features")["features"]}
    check("every feature has one row, a category and a level", len(rows) > 150 and all(r["category"] and r["visibility"] for r in rows.values()), len(rows))
    compared = 0
    for name, (kind, address) in documented().items():
        if name not in rows or kind not in ("integer", "boolean") or rows[name]["value"] is None:
            continue
        value = rows[name]["value"]
        if isinstance(value, str) or name in ("TimestampLatchValue", "GevTimestampTickFrequency") or name.startswith(("Stream", "GevMACAddress")):
            continue
        compared += 1
        word = client.read(address)
        if int(value) not in (word, word - (1 << 32)):
            check(f"{name} is what a client reads", False, (value, word))
    check("integers and booleans are what a client reads", compared > 25, compared)
    check("numbers have their unit and scale", rows["Gain"]["value"] == camera.get("Gain") and rows["Gain"]["unit"] == "dB" and rows["ExposureTime"]["max"] == 3.6e9, rows["Gain"])
    check("an item of a selector is a feature", rows["TriggerMode[FrameStart]"]["value"] == "On" and rows["TriggerMode[AcquisitionStart]"]["entries"] == ["Off", "On"])
    check("a region that is off has its switch only", rows["RegionMode[Region1]"]["value"] == "Off" and "Width[Region0]" in rows and "Width[Region1]" not in rows)
    check("selectors themselves are left out", "TriggerSelector" not in rows and "UserSetSelector" in rows)
    check("bootstrap registers are the client's", not rows["GevSCPSPacketSize"]["writable"] and not rows["AcquisitionStart"]["writable"] and rows["GevCurrentIPAddress"]["value"] == "127.0.0.1")


def written_features(camera):
    value = lambda name: next(r["value"] for r in camera.call("device.features")["features"] if r["name"] == name)
    camera.set(Gain=3)
    for name, wanted in ("UserSetSelector", "UserSet1"), ("UserSetSave", True):
        camera.call("device.set", name=name, value=wanted)
    camera.set(Gain=9)
    camera.call("device.set", name="UserSetLoad", value=True)
    check("a user set brings its settings back", camera.get("Gain") == 3)
    camera.call("device.set", name="TriggerDivider", value=4)
    check("a feature is a setting", camera.get("TriggerDivider") == 4)
    camera.call("device.set", name="TriggerDivider", value=1)
    camera.call("device.set", name="DeviceUserID", value="bench 3")
    check("a text is written whole", value("DeviceUserID") == "bench 3")
    for name, wanted, message in (("NoSuch", 1, "no such feature"), ("GevSCPHostPort", 4, "cannot be written here"), ("GevCCP", "ControlAccess", "cannot be written here"),
                                  ("AcquisitionStart", True, "cannot be written here"), ("TriggerDivider", 0, "not allowed"), ("TriggerDivider", 1.5, "not allowed"),
                                  ("TriggerDivider", 2**33, "not allowed"), ("TriggerDivider", "2", "not allowed"), ("TriggerMode[FrameStart]", "Of", "not allowed"),
                                  ("UserSetLoad", False, "a command"), ("DeviceUserID", "x" * 17, "up to 16"), ("DeviceUserID", "\x1b[1m", "printable"), ("TriggerMode[0]", "Off", "no such feature")):
        check_refused(f"{name} = {wanted!r:.20} is refused", "bad-argument", message, lambda n=name, v=wanted: camera.call("device.set", name=n, value=v))
    check_refused("a list is no value", "bad-argument", "device.set: value", lambda: camera.call("device.set", name="TriggerDivider", value=[1]))


def settings(camera):
    told = camera.call("camera.features")
    rows = {row["name"]: row for row in told["features"]}
    check("settings have their SFNC category", {rows[n]["category"] for n in ("Width", "PixelFormat")} == {"ImageFormatControl"} and rows["Gain"]["category"] == "AnalogControl" and
          {rows[n]["category"] for n in ("ExposureTime", "TriggerDelay", "AcquisitionBurstFrameCount")} == {"AcquisitionControl"})
    readout = told["readout"]
    check_near("the highest rate is that of the shortest time between triggers", readout["max_rate_hz"] * readout["frame_period_us"], 1e6, 1)
    device = {row["name"]: row["value"] for row in camera.call("device.features")["features"]}
    check_near("and that of the GigE Vision side", readout["max_rate_hz"], device["ResultingFrameRate"], 0.001)
    check_near("as is the readout's time", readout["readout_us"], device["SensorReadoutTime"], 0.01)
    check("the window is that of the settings", [readout["windows"][0][k] for k in ("x", "y", "width", "height")] == [0, 0, 64, 48], readout)


def client_and_stream(camera, client, daemon):
    gige = lambda: camera.state()["cameras"][0]["transports"]["gige"]
    check("nobody has a stream", "stream_to" not in gige() and "controller_silent_s" not in gige() and camera.call("faults.list")["frame"] == 0)
    check("a client takes control", client.write(CONTROL_PRIVILEGE, CONTROL) == 0)
    check("it has been heard", 0 <= gige()["controller_silent_s"] < PATIENCE_S)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sink:
        sink.bind(("127.0.0.1", 0))
        for address, value in (STREAM_ADDRESS, 0x7F000001), (STREAM_PORT, sink.getsockname()[1]), (PACKET_SIZE, 1400), (ACQUISITION_START, 1):
            check("the stream is opened", client.write(address, value) == 0)
        wait_for(lambda: gige()["delivered"] >= 3)
        now = gige()
        check("it is known where it goes", now["stream_to"] == f"127.0.0.1:{sink.getsockname()[1]}" and now["packet_bytes"] == 1400, now)
        frame = camera.call("faults.list")["frame"]
        check("frames of the stream are counted", frame >= 3, frame)
        # Two frames from the next but one on.
        camera.set_faults({"kind": "skip_frame", "first": frame + 2, "last": frame + 3})
        wait_for(lambda: camera.call("faults.list")["frame"] > frame + 4)
        check("a window of frames from now on strikes as many", camera.faults()[0]["struck"] == 2, camera.faults())
        camera.set_faults()
        held = {row["name"]: row for row in camera.call("device.features")["features"]}
        check("what is fixed while it acquires says so", held["Width[Region0]"]["locked"] and not held["Gain"]["locked"])
        check_refused("its features are not written beside it", "controlled", client.address(), lambda: camera.call("device.set", name="TriggerDivider", value=2))
        check("it is disconnected", camera.call("release")["controller"] == client.address())
        wait_for(lambda: camera.state()["cameras"][0]["controller"] == "")
        check("then it may not write", client.write(GAIN, 0) != 0)
        check("and there is nobody left to disconnect", camera.call("release")["controller"] == "")
    check("the log tells it", any("loses control" in e["text"] for e in camera.events()))


def daemon_itself(camera, daemon):
    state = camera.state()
    own = [t for t in state["threads"] if t["name"] == "obscurad"]
    check("a thread's cores are the kernel's", own and own[0]["cores"] == re.search(r"Cpus_allowed_list:\s*(\S+)", pathlib.Path(f"/proc/{daemon.pid}/status").read_text())[1] and
          0 <= own[0]["processor"] < os.cpu_count(), own)
    beats = {b["name"]: b for b in state["heartbeats"]}
    check("supervised threads beat", {"gige-control", "gige-stream", "file-sink"} <= beats.keys() and all(b["silent"] or b["age_s"] < PATIENCE_S for b in beats.values()), beats)
    check("advice is in sentences", all(line.endswith(".") for line in state["daemon"]["advice"]), state["daemon"])
    camera.call("log_level", level="warning")
    check("the log level changes", camera.state()["daemon"]["log_level"] == "warning" and camera.call("log_level", level="info")["before"] == "warning")
    check_refused("another one is refused", "bad-argument", "level", lambda: camera.call("log_level", level="loud"))
    catalogue = (source / "systemd/obscura.catalog").read_text()
    start = next(e for e in camera.events() if " starting with " in e["text"])
    check("a line of the log names its message of the catalogue", f"-- {start['message']}\nSubject: obscurad" in catalogue, start)


def scene(camera, small):
    told = camera.call("scene.describe")
    check("the scene is described", told["file"] == str(small.config.parent / "scene.toml") and told["scene_time"] == "nominal" and told["simulator"] is None, told)
    check("with its bodies", len(told["bodies"]) == (small.config.parent / "scene.toml").read_text().count("[[body]]") and all(b["source"] == "scene" for b in told["bodies"]), told["bodies"])
    lens = told["camera"]
    entries = {e["key"]: float(e["value"]) for e in camera.configuration()["entries"] if e["key"] in ("sensor.pixel_pitch_um", "sensor.readout.width")}
    wanted = 2 * math.degrees(math.atan(entries["sensor.readout.width"] * entries["sensor.pixel_pitch_um"] * 1e-6 / 2 / lens["focal_length_m"]))
    check_near("and its field of view", lens["field_of_view_deg"][0], wanted, 1e-9)
    check("where nothing follows a trajectory there are no times of one", told["trajectory_s"] == [], told)
    folder = small.config.parent
    (folder / "path.csv").write_text("time_s,x_m,y_m,z_m\n0,-20000,0,0\n2.5,-20000,10,0\n4,-20000,20,0\n")
    (folder / "moving.toml").write_text((folder / "scene.toml").read_text().replace("position_m = [-20000, 0, 0]", 'trajectory = "path.csv"'))
    camera.show_scene("moving.toml")
    told = camera.call("scene.describe")
    check("a trajectory has the times of its points", told["camera"]["motion"] == "trajectory" and told["trajectory_s"] == [0, 2.5, 4], told)
    camera.show_scene("scene.toml")


def reload(camera, small):
    text = small.config.read_text()
    small.config.write_text(text.replace("rate_hz = 10", "rate_hz = 25"))
    camera.call("reload")
    rate = next(e["value"] for e in camera.configuration()["entries"] if e["key"] == "trigger.rate_hz")
    check("the file is read again", float(rate) == 25, rate)
    small.config.write_text(text.replace("width = 64", "width = 32"))
    check_refused("what cannot change while running is refused", "not-now", "sensor.readout.width cannot change while running", lambda: camera.call("reload"))
    small.config.write_text(text.replace("rate_hz = 10", "rate_hz = -1"))
    check_refused("and a bad file, with the place", "not-now", f"{small.config}:", lambda: camera.call("reload"))
    check("the one before stays in use", float(next(e["value"] for e in camera.configuration()["entries"] if e["key"] == "trigger.rate_hz")) == 25)


with tempfile.TemporaryDirectory(prefix="obscura-daemon-calls-") as temporary:
    folder, gvcp = pathlib.Path(temporary), free_port(socket.SOCK_DGRAM)
    folder.chmod(0o755)
    small = SmallDaemon(folder, obscurad, source, tables=f'[control]\nunix_socket = "{folder}/calls"\nscenes = "{folder}"\n')
    small.config.write_text(small.config.read_text().replace(
        "[gige]\nenabled = false", f'[gige]\nenabled = true\ninterface = "127.0.0.1"\nport = {gvcp}\nstate_file = "{folder}/state"'))
    daemon = small.start("--ready-file", folder / "ready")
    try:
        wait_for(lambda: (folder / "ready").exists())
        with obscura_client.connect_camera(str(folder / "calls"), timeout_s=PATIENCE_S) as camera:
            client = GvcpClient(gvcp, PATIENCE_S)
            features_and_registers(camera, client)
            written_features(camera)
            settings(camera)
            client_and_stream(camera, client, daemon)
            daemon_itself(camera, daemon)
            scene(camera, small)
            reload(camera, small)
        daemon.send_signal(signal.SIGTERM)
        check("the daemon ends well", daemon.wait(PATIENCE_S) == 0)
    finally:
        if daemon.poll() is None:
            daemon.kill()
            daemon.wait()
sys.exit(end())
