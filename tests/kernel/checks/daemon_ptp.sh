# SPDX-License-Identifier: Apache-2.0
# Edges on a PTP clock's input and a scheduled start on that clock through the real daemon
# lane: video
# time limit: 300 s
. "$RIG/guest/daemon.sh"
load pps-gpio
load rig_triggers
daemon_start 16 16 '[trigger]
source = "ptp"
channel = 1
rate_hz = 20
over_trigger = "latch"
[camera]
exposure_us = 1000'
said=$(python3 "$RIG/programs/fire_edges.py" /sys/kernel/debug/rig_triggers/extts frames 1 200 1 2>&1) || fail "EXTTS: $said: $(cat daemon.log)"
figure "EXTTS: $said"
daemon_stop

# This machine's simulated PTP clock is 37 s ahead of the time of day.
start=$(($(date +%s) + 37 + 4)).25
daemon_start 16 16 "[trigger]
source = \"ptp_timer\"
start = \"$start\"
rate_hz = 4
[camera]
exposure_us = 1000"
wait_for 30 test -e frames/frame_000012.toml || fail "no frames after the scheduled start: $(cat daemon.log)"
said=$(python3 - "$start" 2>&1 <<'END'
import pathlib, re, sys, time
start_ns = int(float(sys.argv[1]) * 1e9)
difference = time.time_ns() - time.monotonic_ns() + 37_000_000_000
worst, skipped = 0, None
for told in sorted(pathlib.Path("frames").glob("frame_*.toml"))[:12]:
    text = told.read_text()
    edge, trigger = (int(re.search(rf"^{key} *= *(\d+)\b", text, re.M)[1]) for key in ("T_EDGE", "TRIGID"))
    if skipped is None:  # slots that had passed before a slow machine's daemon was ready
        skipped = round((edge + difference - start_ns) / 250e6) - (trigger - 1)
        if skipped < 0:
            sys.exit("an edge before the scheduled start")
    worst = max(worst, abs(edge + difference - start_ns - (trigger - 1 + skipped) * 250_000_000))
if worst > 3_000_000:
    sys.exit(f"an edge is {worst / 1e6} ms from its place in the PTP clock")
print(f"12 frames from slot {skipped} after the scheduled start on, at most {worst / 1e3:.0f} us from their places in the PTP clock's time")
END
) || fail "$said: $(cat daemon.log)"
figure "PTP: $said"
grep -q 'clock: locked (ptp_timer)' daemon.log || fail "the clock was never locked: $(cat daemon.log)"
daemon_stop
