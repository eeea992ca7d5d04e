# SPDX-License-Identifier: Apache-2.0
# PPS through the real daemon: slots in step with the pulses, holdover without them
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
