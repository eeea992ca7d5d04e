# SPDX-License-Identifier: Apache-2.0
# The daemon's own lines: trigger ready and exposure active on simulated GPIO
# lane: clocks
# time limit: 240 s
. "$RIG/guest/daemon.sh"
gpio_up lines 8 3=LINES_TRIG_IN 4=READY_OUT 5=EXPOSURE_OUT
daemon_start 16 16 '[trigger]
source = "gpio"
line = "LINES_TRIG_IN"
rate_hz = 1
[camera]
exposure_us = 100000
[outputs]
trigger_ready = "READY_OUT"
exposure = "EXPOSURE_OUT"'
said=$(python3 "$RIG/programs/watch_lines.py" "$GPIO_LINES" 3 4 5 100 10 2>&1) || fail "$said: $(cat daemon.log)"
figure "$said"
sleep 1 # the last frames are stored
daemon_stop
daemon_undisturbed file
[ "$(cat "$GPIO_LINES/sim_gpio4/value")" = 0 ] || fail "the ready line stays up after the end"
gpio_down lines
