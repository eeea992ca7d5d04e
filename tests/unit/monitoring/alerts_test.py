#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Has promtool evaluate the alert rules on series of cameras with which one thing at a time is wrong: the alert for it fires, and no other. The expressions of
the dashboard are read by promtool, too.

Usage: alerts_test.py SOURCE-DIRECTORY
Exit status 77 (skipped) without promtool (Debian package prometheus), 1 if a check failed.
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from checks import check, failures  # noqa: E402

folder = pathlib.Path(sys.argv[1]).resolve() / "config/monitoring"
rules = folder / "alerts.yml"
if not shutil.which("promtool"):
    print("skipped: promtool is not installed (Debian package prometheus)")
    sys.exit(77)
STEPS = 60  # of 15 s
AT = "10m"
OF = {"config": "/etc/obscura/obscurad.toml", "camera": "0", "instance": "bench:8420", "job": "obscura"}
SERVER = {"instance": "bench:8420", "job": "obscura"}
DAEMON = {"config": "/etc/obscura/obscurad.toml"} | SERVER


def promtool(*arguments):
    done = subprocess.run(["promtool", *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=100)
    return done.returncode, done.stdout


def series(name, of=None, **labels):
    return f"obscura_{name}{{{','.join(f'{key}=' + json.dumps(value) for key, value in ((OF if of is None else of) | labels).items())}}}"


def always(value):
    return f"{value}x{STEPS}"


def growing(each):
    return f"0+{each}x{STEPS}"


def once(count):
    """A counter that grows at a single moment half a minute before the look."""
    return f"0x37 {count}x{STEPS - 38}"


# A camera that is on time at 10 Hz, locked to a pulse per second, with a client and a viewer.
GOOD = {
    series("build_info", DAEMON, version="1"): always(1), series("acquiring"): always(1), series("camera_bad"): always(0),
    series("frames_total", outcome="complete"): growing(150), series("frames_total", outcome="abandoned"): always(0),
    series("frame_age_seconds"): always(0.1), series("frame_overdue_seconds"): always(2),
    series("trigger_info", source="Line0", line0="pps"): always(1),
    **{series("clock_state", state=state): always(int(state == "locked")) for state in ("free", "locked", "holdover", "lockstep")},
    series("rows_late_total"): always(3), series("rows_stalled_total"): always(0), series("triggers_missed_total", reason="rendering"): always(9),
    series("triggers_total", outcome="dropped"): always(0), series("frames_unsent_total"): always(0),
    **{series("transport_frames_total", transport=transport, outcome="dropped"): always(2) for transport in ("gige", "file", "watch")},
    series("transport_value", transport="gige", counter="no_receiver"): always(2),
    series("gige_control_lost_total"): always(1), series("faults_struck_total", kind="lose"): always(0),
    series("frame_pool_frames", state="used"): always(3), series("frame_pool_frames", state="free"): always(13),
    series("heartbeat_age_seconds", thread="render"): always(0.1),
    series("web_frames_total", SERVER, outcome="sent"): growing(150), series("web_frames_total", SERVER, outcome="skipped"): growing(20),
}


def clock(state, source):
    """Its trigger is of another source, and its clock in that state from 9 minutes on."""
    changes = {series("trigger_info", source="Line0", line0="pps"): None, series("trigger_info", source="Line0", line0=source): always(1)}
    for one in "free", "locked", "holdover":
        late = int(one == state)
        changes[series("clock_state", state=one)] = f"{int(one == 'locked')}x35 {late}x{STEPS - 36}"
    return changes


NO_FRAME_YET = {series("frame_age_seconds"): None, series("frame_overdue_seconds"): None, series("frames_total", outcome="complete"): always(0)}
GIGE_DROPS = {series("transport_frames_total", transport="gige", outcome="dropped"): growing(150)}
UNSENT = {series("frames_unsent_total"): growing(150)}
# What is wrong, the series that differ (None: not there), and the alerts that fire.
CASES = [
    ("nothing", {}, []),
    ("no daemon", {name: f"{GOOD[name].split('x')[0]}x18 stale" for name in GOOD}, ["ObscuraAbsent"]),
    ("one of two daemons has gone", {series("build_info", DAEMON | {"config": "north"}, version="1"): "1x30 stale"}, ["ObscuraAbsent"]),
    ("nothing, after a restart with another version", {series("build_info", DAEMON, version="1"): "1x30 stale", series("build_info", DAEMON, version="2"): "_x31 1x40"}, []),
    ("triggers have stopped", {series("frame_age_seconds"): "0.1x37 4 19 34"}, ["ObscuraNoFrame"]),
    ("no trigger has come yet", NO_FRAME_YET | {series("camera_bad"): always(1)}, ["ObscuraNoFrame"]),
    ("nothing, where frames come on request", NO_FRAME_YET, []),
    ("nothing, where the acquisition is stopped", NO_FRAME_YET | {series("acquiring"): always(0)}, []),
    ("the reference of the clock is missing", clock("holdover", "pps"), ["ObscuraClockNotLocked"]),
    ("it has been missing for long", clock("free", "ptp"), ["ObscuraClockNotLocked"]),
    ("nothing, where a timer has no reference", clock("free", "timer"), []),
    ("nothing, where edges come irregularly", clock("free", "udp"), []),
    ("a row was late", {series("rows_late_total"): once(1)}, ["ObscuraLateRows"]),
    ("rows were stalled", {series("rows_stalled_total"): once(5)}, ["ObscuraStalledRows"]),
    ("a trigger was missed", {series("triggers_missed_total", reason="rendering"): once(1)}, ["ObscuraMissedTriggers"]),
    ("a trigger found no memory", {series("triggers_total", outcome="dropped"): once(1)}, ["ObscuraDropped"]),
    ("the disk is too slow", {series("transport_frames_total", transport="file", outcome="dropped"): once(1)}, ["ObscuraDropped"]),
    ("the network is too slow", GIGE_DROPS, ["ObscuraDropped"]),
    ("nothing, before a client comes", GIGE_DROPS | UNSENT | {series("transport_value", transport="gige", counter="no_receiver"): growing(150)}, []),
    ("nothing, where a viewer is slow", {series("transport_frames_total", transport="watch", outcome="dropped"): growing(100)}, []),
    ("frames go nowhere", UNSENT | {series("camera_bad"): always(1)}, ["ObscuraSentNowhere"]),
    ("viewers get less than half", {series("web_frames_total", SERVER, outcome="skipped"): growing(160)}, ["ObscuraPageSlow"]),
    ("a client was silent", {series("gige_control_lost_total"): once(1)}, ["ObscuraControlLost"]),
    ("transports hold frames", {series("frame_pool_frames", state="used"): always(14), series("frame_pool_frames", state="free"): always(2)},
     ["ObscuraPoolNearlyUsed"]),
    ("a thread hangs", {series("heartbeat_age_seconds", thread="render"): "0.1x37 14 29 44"}, ["ObscuraThreadSilent"]),
    ("a fault is injected", {series("faults_struck_total", kind="lose"): once(1)}, ["ObscuraFaultsArmed"]),
]
names = re.findall(r"- alert: (\w+)", rules.read_text(encoding="utf-8"))
check("each alert has a case in which it fires", sorted(names) == sorted({name for _, _, fired in CASES for name in fired}), names)
told = promtool("check", "rules", str(rules))
check("promtool has nothing to say of the rules", told[0] == 0, told[1])
with tempfile.TemporaryDirectory() as temporary:
    written = pathlib.Path(temporary) / "rules.json"  # JSON is YAML
    for what, changes, fired in CASES:
        where = {"no daemon": {}, "one of two daemons has gone": DAEMON | {"config": "north"}, "viewers get less than half": SERVER}.get(what, OF)
        labels = "".join(f',{key}="{where[key]}"' for key in sorted(where))
        written.write_text(json.dumps({"rule_files": [str(rules)], "evaluation_interval": "15s", "tests": [{
            "interval": "15s",
            "input_series": [{"series": name, "values": values} for name, values in (GOOD | changes).items() if values is not None],
            "promql_expr_test": [{"expr": 'group by (alertname, config, camera, instance, job) (ALERTS{alertstate="firing"})', "eval_time": AT,
                                  "exp_samples": [{"labels": f'{{alertname="{name}"{labels}}}', "value": 1} for name in fired]}]}]}))
        told = promtool("test", "rules", str(written))
        check(f"wrong is {what}: {', '.join(fired) or 'no alert'}", told[0] == 0, told[1])
    dashboard = json.loads((folder / "dashboard.json").read_text(encoding="utf-8"))
    queries = [target["expr"] for panel in dashboard["panels"] for target in panel.get("targets", [])]
    written.write_text(json.dumps({"groups": [{"name": "dashboard", "rules": [{"record": f"query:{k}", "expr": query} for k, query in enumerate(queries)]}]}))
    told = promtool("check", "rules", str(written))
    check(f"promtool reads the {len(queries)} expressions of the dashboard", told[0] == 0 and len(queries) > 10, told[1])
sys.exit(1 if failures else 0)
