# Clocks of the bench through the real daemon: PPS with holdover, edges on a PTP clock's input, a scheduled start on it
# lane: clocks
# time limit: 300 s
. "$RIG/guest/daemon.sh"
load pps-gpio
load rig_triggers
fire=/sys/kernel/debug/rig_triggers
daemon_start 16 16 '[trigger]
source = "pps"
rate_hz = 5
over_trigger = "latch"
[camera]
exposure_us = 1000'
said=$(python3 "$RIG/programs/pps_frames.py" $fire/pps frames 5 41 2>&1) || fail "PPS: $said: $(cat daemon.log)"
figure "PPS: $said"
grep -q 'clock: locked (pps)' daemon.log || fail "the clock was never locked: $(cat daemon.log)"
wait_for 10 grep -q 'clock: holdover (pps)' daemon.log || fail "no holdover after the pulses: $(cat daemon.log)"
daemon_stop
python3 -c 'import json
c = json.load(open("stats.json"))["camera"]
assert c["triggers"] == c["frames"] + c["missed_triggers"] + c["dropped"], c' || fail "slots are neither frames nor counted: $(cat stats.json)"
grep -q 'CLKSTATE.*locked' frames/*.toml || fail "no frame says that its clock was locked"

daemon_start 16 16 '[trigger]
source = "ptp"
channel = 1
rate_hz = 20
[camera]
exposure_us = 1000'
said=$(python3 "$RIG/programs/fire_edges.py" $fire/extts frames 1 200 1 2>&1) || fail "EXTTS: $said: $(cat daemon.log)"
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
rmmod rig_triggers
