# SPDX-License-Identifier: Apache-2.0
# From the trigger to the first row with GPIO, PPS and PTP triggers, as rows of the table in docs/tuning.md
# lane: last
# time limit: 300 s
. "$RIG/guest/daemon.sh"
load pps-gpio
load rig_triggers
gpio_up first 8 3=FIRST_IN
frames=40
start() { # TRIGGER-TOML
    daemon_start 96 64 "$1
over_trigger = \"latch\"
[camera]
exposure_us = 20000" 12 --timing timing.csv
}
measured() { # SOURCE
    daemon_stop
    said=$(python3 "$RIG/../bench/first_row.py" --of timing.csv --source "$1" --scene "96 x 64" --load "emulated machine") || say "late rows: $said"
    [ -n "$said" ] || fail "$1: no frames: $(cat daemon.log)"
    figure "$said"
}
start '[trigger]
source = "gpio"
line = "FIRST_IN"
rate_hz = 4'
python3 "$RIG/programs/jitter_edges.py" "$GPIO_LINES/sim_gpio3/pull" $frames 0.25 0
measured gpio
start '[trigger]
source = "pps"
rate_hz = 4'
said=$(python3 "$RIG/programs/pps_frames.py" /sys/kernel/debug/rig_triggers/pps frames 4 12 2>&1) || say "PPS: $said"
measured pps
start '[trigger]
source = "ptp_timer"
rate_hz = 4'
wait_for 30 test -e "$(printf 'frames/frame_%06d.toml' $frames)" || fail "ptp_timer: too few frames: $(cat daemon.log)"
measured ptp_timer
gpio_down first
