#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What obscura metrics prints of a daemon with more triggers than its sensor can take is well formed, adds up and is what the
daemon's own files say.

Usage: metrics_test.py OBSCURAD OBSCURA SOURCE-DIRECTORY
With Python's prometheus_client (Debian package python3-prometheus-client) its parser reads the text too. Exit status 1 if a
check failed.
"""
import importlib.util
import itertools
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from small_daemon import SmallDaemon  # noqa: E402

obscurad, obscura, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
PATIENCE_S = 60  # a busy machine, a sanitizer
NAMES = source / "docs/monitor.md"
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
            pairs = dict(re.findall(r'([a-z_]+)="((?:[^"\\]|\\.)*)"', labels or ""))
            pairs.pop("config", None)
            key = name, tuple(sorted(pairs.items()))
            assert key not in values, line
            values[key] = float(value)
    return values, types


def of(values, name, **labels):
    return values.get((name, tuple(sorted({"camera": "0", **labels}.items()))))


def total(values, name):
    return sum(value for (one, _), value in values.items() if one == name)


with tempfile.TemporaryDirectory(prefix="obscura-metrics-") as temporary:
    folder = pathlib.Path(temporary)
    # A frame takes the sensor 20 ms, and triggers come every 5.
    camera = SmallDaemon(folder, obscurad, source, name='a "quoted" name.toml', rate_hz=200,
                         tables="pixel_clock_hz = 153600\n[camera]\nexposure_us = 100\n")

    def metrics(*arguments):
        return subprocess.run([obscura, "metrics", "--socket", camera.socket, *arguments], capture_output=True, text=True, timeout=PATIENCE_S)

    missing = metrics("-o", folder / "none.prom")
    check("without a daemon the status is 69, and no file is written", missing.returncode == 69 and not (folder / "none.prom").exists(),
          missing)
    statistics, timing = folder / "statistics.json", folder / "timing.csv"
    daemon = camera.start("--stats", statistics, "--timing", timing)
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        found = metrics()
        if found.returncode == 0 and (of(parsed(found.stdout)[0], "obscura_frames_total", outcome="complete") or 0) > 5:
            break
        time.sleep(0.1)
    scrapes = [metrics().stdout for _ in range(10)]
    every = [parsed(text) for text in scrapes]
    for (before, types), (after, _) in zip(every, every[1:]):
        down = [key for key, value in before.items() if after.get(key, -1) < value and
                types.get(re.sub("_(bucket|sum|count)$", "", key[0]), types.get(key[0])) in ("counter", "histogram")]
        if down:
            check("counters never fall", False, down)
    values, types = every[-1]
    check("triggers are missed", of(values, "obscura_triggers_missed_total", reason="chip_busy") > 0, scrapes[-1])
    for values, _ in every:
        outcomes, seen = total(values, "obscura_triggers_total"), of(values, "obscura_triggers_seen_total")
        reasons, missed = total(values, "obscura_triggers_missed_total"), of(values, "obscura_triggers_total", outcome="missed")
        if not (0 <= seen - outcomes <= 2 and reasons == missed):
            check("outcomes sum to edges, and reasons to missed ones", False, (outcomes, seen, reasons, missed))
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
    # Only a camera that sends has further counters of a transport, and first bytes.
    sending = {"obscura_transport_value", "obscura_trigger_to_first_byte_seconds"}
    check("the names are those of docs/monitor.md", documented == set(types) | sending, documented ^ set(types))
    check("at most 400 series", len(values) <= 400, len(values))
    rules = (source / "config/monitoring/alerts.yml").read_text(encoding="utf-8") + (
        source / "config/monitoring/dashboard.json").read_text(encoding="utf-8")
    used = {re.sub("_(bucket|sum|count)$", "", name) if name not in types else name for name in re.findall(r"\bobscura_[a-z_]+", rules)}
    check("alert rules and dashboard use names that exist", used and used <= set(types), used - set(types))
    if importlib.util.find_spec("prometheus_client"):
        from prometheus_client.parser import text_string_to_metric_families
        theirs = sum(len(family.samples) for family in text_string_to_metric_families(scrapes[-1]))
        check("prometheus_client reads as many samples", theirs == len(values), (theirs, len(values)))
    else:
        print("skipped: prometheus_client is not installed")
    written = folder / "obscura.prom"
    check("--output writes a file that others may read", metrics("-o", written).returncode == 0 and parsed(written.read_text()) and
          os.stat(written).st_mode & 0o444 == 0o444, oct(os.stat(written).st_mode))

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
