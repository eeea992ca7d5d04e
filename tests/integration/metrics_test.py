#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What obscura metrics and obscura-web tell of a daemon that gets ten times the triggers that its sensor can take for ten seconds, as datagrams, is well
formed, adds up in each of a thousand scrapes, and is what the daemon's own files say.

Usage: metrics_test.py OBSCURAD OBSCURA OBSCURA-WEB SOURCE-DIRECTORY
With Python's prometheus_client (Debian package python3-prometheus-client) its parser reads the text too, and with promtool (prometheus) that. Exit status 1
if a check failed.
"""
import importlib.util
import itertools
import json
import os
import pathlib
import re
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from small_daemon import SmallDaemon  # noqa: E402
from web_server import Web  # noqa: E402

obscurad, obscura, web, source = *sys.argv[1:4], pathlib.Path(sys.argv[4])
PATIENCE_S = 60  # a busy machine, a sanitizer
NAMES = source / "docs/control.md"
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def parsed(text):
    """Values by name and labels, as this test understands the format; and the types of the families."""
    values, types, family = {}, {}, None
    for line in text.splitlines():
        if line.startswith("# HELP "):
            family = line.split()[2]
            assert family not in types and len(line.split()) > 3, line
        elif line.startswith("# TYPE "):
            assert line.split()[2] == family, line
            types[family] = line.split()[3]
        else:
            name, labels, value = re.fullmatch(r"([a-z_]+)(?:\{(.*)\})? (\S+)", line).groups()
            assert name == family or types[family] == "histogram" and re.sub("_(bucket|sum|count)$", "", name) == family, line
            pairs = dict(re.findall(r'([a-z0-9_]+)="((?:[^"\\]|\\.)*)"', labels or ""))
            pairs.pop("config", None)
            key = name, tuple(sorted(pairs.items()))
            assert key not in values, line
            values[key] = float(value)
    return values, types


def of(values, name, **labels):
    return values.get((name, tuple(sorted({"camera": "0", **labels}.items()))))


def total(values, name):
    return sum(value for (one, _), value in values.items() if one == name)


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_for(done):
    limit = time.monotonic() + PATIENCE_S
    while not done() and time.monotonic() < limit:
        time.sleep(0.1)


with tempfile.TemporaryDirectory(prefix="obscura-metrics-") as temporary:
    folder = pathlib.Path(temporary)
    # A frame takes the sensor 20 ms, and triggers come every 2.
    edges, rate_hz = 5000, 500
    gvcp, triggers, poses = free_port(), f"127.0.0.1:{free_port()}", free_port()
    camera = SmallDaemon(folder, obscurad, source, name='a "quoted" name.toml', rate_hz=50,
                         tables=f"""pixel_clock_hz = 153600
[camera]
exposure_us = 100
[daemon]
autostart = true
[control]
unix_socket = "{folder / 'calls'}"
[simulator]
enabled = true
listen = "127.0.0.1:{poses}"
""")
    camera.config.write_text(camera.config.read_text().replace("[gige]\nenabled = false", f"""[gige]
interface = "127.0.0.1"
port = {gvcp}""").replace("[trigger]", f"""[trigger]
source = "udp"
listen = "{triggers}\""""))

    def metrics(*arguments):
        return subprocess.run([obscura, "metrics", "--socket", camera.socket, *arguments], capture_output=True, text=True, timeout=PATIENCE_S)

    missing = metrics("-o", folder / "none.prom")
    check("without a daemon the status is 69, and no file is written", missing.returncode == 69 and not (folder / "none.prom").exists(),
          missing)
    statistics, timing = folder / "statistics.json", folder / "timing.csv"
    daemon = camera.start("--stats", statistics, "--timing", timing)

    def value(name, **labels):
        return of(parsed(metrics().stdout)[0], name, **labels) or 0

    wait_for(lambda: value("obscura_acquiring"))
    server = Web(web, "--socket", camera.socket)
    wait_for(lambda: "obscura_acquiring" in server.ask("/metrics").text)
    served = []

    def scrape():
        connection = server.connection()
        while len(served) < 1000:
            connection.request("GET", "/metrics", headers={"Authorization": f"Bearer {server.token}"})
            served.append(connection.getresponse().read().decode())
            time.sleep(0.008)
        connection.close()

    scraper = threading.Thread(target=scrape)
    scraper.start()
    # The last ones come slowly, so that none of them is lost on the way and a gap before them is seen.
    slow = 20
    sender = subprocess.Popen(f"'{obscura}' trigger --udp {triggers} --rate {rate_hz} --frames {edges - slow} && "
                              f"'{obscura}' trigger --udp {triggers} --rate 100 --first {edges - slow + 1} --frames {slow}", shell=True,
                              stdout=subprocess.DEVNULL)
    wait_for(lambda: value("obscura_frames_total", outcome="complete") > 5)
    scrapes = [metrics().stdout]
    while sender.poll() is None:
        scrapes.append(metrics().stdout)
    check("all of them are sent", sender.wait(PATIENCE_S) == 0)
    check("triggers come and are missed while they are counted", len({text for text in scrapes if "reason=\"chip_busy\"" in text}) > 10 and
          of(parsed(scrapes[5])[0], "obscura_triggers_missed_total", reason="chip_busy") > 0, scrapes[5])
    wait_for(lambda: value("obscura_triggers_seen_total") >= edges)
    time.sleep(0.2)  # the last frame ends
    scrapes.append(metrics().stdout)
    scraper.join()
    every = [parsed(text) for text in scrapes]
    of_web = [parsed(text) for text in served]
    for what, series in (f"{len(every)} runs of obscura metrics", every), (f"{len(of_web)} scrapes of obscura-web", of_web):
        down = [key for (before, types), (after, _) in zip(series, series[1:]) for key, value in before.items() if after.get(key, -1) < value and
                types.get(re.sub("_(bucket|sum|count)$", "", key[0]), types.get(key[0])) in ("counter", "histogram")]
        check(f"counters never fall in {what}", not down, down)
        seen = [of(values, "obscura_triggers_seen_total") for values, _ in series]
        check("which see the run go on", len(set(seen)) > 10 and max(seen) > edges / 2, sorted(set(seen)))
    values, types = every[-1]
    check("each edge is one, and most of them are missed", of(values, "obscura_triggers_seen_total") == edges ==
          total(values, "obscura_triggers_total") and of(values, "obscura_triggers_total", outcome="missed") > edges / 2, scrapes[-1])
    off = []
    for values, _ in every + of_web:
        outcomes, seen = total(values, "obscura_triggers_total"), of(values, "obscura_triggers_seen_total")
        reasons, missed = total(values, "obscura_triggers_missed_total"), of(values, "obscura_triggers_total", outcome="missed")
        if not (0 <= seen - outcomes <= 2 and reasons == missed):
            off.append((outcomes, seen, reasons, missed))
    check("in each scrape outcomes sum to edges, but for one in work and one latched, and reasons to missed ones", not off, off)
    values, types = every[-1]
    for name, kind in types.items():
        if kind != "histogram":
            continue
        buckets = [value for (one, _), value in values.items() if one == f"{name}_bucket"]
        check(f"{name} is cumulative, and +Inf is its count", buckets == sorted(buckets) and buckets[-1] == total(values, f"{name}_count") and
              len(buckets) == 20, buckets)
        check(f"{name} has a sum", total(values, f"{name}_sum") > 0)
    check("the quotes of the configuration's name are escaped", r'a \"quoted\" name.toml"' in scrapes[-1])
    section = NAMES.read_text(encoding="utf-8").split("\n## Metrics\n")[1].split("\n## ")[0]
    documented = set(re.findall(r"`(obscura_[a-z_]+)`", section))
    # Only a camera that sends has first bytes, and only a clock with a reference an offset.
    others = {"obscura_trigger_to_first_byte_seconds", "obscura_clock_offset_seconds", "obscura_ptp_offset_seconds",
              "obscura_ptp_path_delay_seconds"}
    check("the names are those of docs/control.md", documented == set(types) | others, documented ^ set(types))
    check("at most 400 series", len(values) <= 400, len(values))
    check("the buffers are those of the pool", of(values, "obscura_frame_pool_frames", state="free") > 0 and
          total(values, "obscura_frame_pool_frames") >= 3)
    check("threads beat", 0 <= max(age for (name, _), age in values.items() if name == "obscura_heartbeat_age_seconds") < PATIENCE_S)
    check("the configuration is of this minute", abs(total(values, "obscura_config_last_reload_success_timestamp_seconds") - time.time()) <
          10 * PATIENCE_S)
    rules = (source / "config/monitoring/alerts.yml").read_text(encoding="utf-8") + (
        source / "config/monitoring/dashboard.json").read_text(encoding="utf-8")
    used = {re.sub("_(bucket|sum|count)$", "", name) if name not in types else name for name in re.findall(r"\bobscura_(?!web_)[a-z_]+", rules)}
    check("alert rules and dashboard use names that exist", used and used <= set(types) | others, used - set(types))
    with socket.create_connection(("127.0.0.1", poses), PATIENCE_S) as simulator:
        simulator.sendall(b"pose camera 0.0 0 0 0 1 0 0 0\npose nobody 0.0 0 0 0 1 0 0 0\n")
        wait_for(lambda: value("obscura_simulator_lines_total", kind="refused"))
    check("lines of a simulator are counted by kind", [value("obscura_simulator_lines_total", kind=kind) for kind in ("pose", "step", "refused")] == [1, 0, 1]
          and value("obscura_simulator_connections_total") == 1, metrics().stdout)
    check("the trigger is named", of(values, "obscura_trigger_info", source="Line0", line0="udp") == 1, scrapes[-1])
    check("a frame is overdue from two seconds on", of(values, "obscura_frame_overdue_seconds") >= 2 and of(values, "obscura_frame_age_seconds") >= 0, scrapes[-1])
    if shutil.which("promtool"):
        told = subprocess.run(["promtool", "check", "metrics"], input=scrapes[-1], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        check("promtool has nothing to say", told.returncode == 0, told.stdout)
    else:
        print("skipped: promtool is not installed")
    if importlib.util.find_spec("prometheus_client"):
        from prometheus_client.parser import text_string_to_metric_families
        theirs = sum(len(family.samples) for family in text_string_to_metric_families(scrapes[-1]))
        check("prometheus_client reads as many samples", theirs == len(values), (theirs, len(values)))
    else:
        print("skipped: prometheus_client is not installed")
    written = folder / "obscura.prom"
    check("--output writes a file that others may read", metrics("-o", written).returncode == 0 and parsed(written.read_text()) and
          os.stat(written).st_mode & 0o444 == 0o444, oct(os.stat(written).st_mode))

    def fault(*words):
        return subprocess.run([obscura, "fault", *words, "--socket", camera.socket], capture_output=True, timeout=PATIENCE_S).returncode

    def strikes():
        """What a rule has struck in all, once it has struck a command."""
        before = value("obscura_faults_struck_total", kind="mute_control")
        check("a fault is armed", fault("add", "mute_control") == 0)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.sendto(struct.pack(">BBHHHI", 0x42, 1, 0x80, 4, 1, 0), ("127.0.0.1", gvcp))  # reads a register
        wait_for(lambda: value("obscura_faults_struck_total", kind="mute_control") > before)
        check("and cleared", fault("clear") == 0)
        return value("obscura_faults_struck_total", kind="mute_control")

    check("strikes are counted beyond the end of their rule", [strikes(), strikes()] == [1, 2], metrics().stdout)
    received, results = value("obscura_gige_commands_received_total"), total(parsed(metrics().stdout)[0], "obscura_gige_commands_total")
    check("so are commands", received == 2 and results == 0, (received, results))

    check("the web server ends well", server.end() == 0, server.log)
    daemon.terminate()
    check("the daemon ends well", daemon.wait(PATIENCE_S) == 0)
    told = json.loads(statistics.read_text())
    counters = told["camera"]
    check("in the end outcomes sum to edges exactly", counters["triggers"] == sum(
        counters[k] for k in ("frames", "missed_triggers", "masked_triggers", "dropped")) and
          counters["missed_triggers"] == sum(counters["missed_because"].values()), counters)
    report = subprocess.run([obscura, "timing", timing, "--format", "csv"], capture_output=True, text=True, check=True).stdout
    figures = told["latency_us"] | told["stages_us"]
    for span, name in (("edge_to_first_row", "trigger_to_first_row"), ("edge_to_last_row", "trigger_to_last_row"),
                       ("edge_to_seen", "trigger_seen"), ("rendering", "render"), ("render_end_to_detector_end", "detector")):
        row = next(line.split(",") for line in report.splitlines() if line.split(",")[1:2] == [span])
        counts = [int(value) for value in row[7:]]
        check(f"{name} is what obscura timing makes of the same run", figures[name]["up_to"] == list(itertools.accumulate(counts[:-1])),
              (figures[name], row))
sys.exit(1 if failures else 0)
