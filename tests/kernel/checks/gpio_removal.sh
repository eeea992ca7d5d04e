# SPDX-License-Identifier: Apache-2.0
# The GPIO chip of trigger and lines removed under the real daemon and given back: edges, ready and exposure within 2 s
# lane: last
# time limit: 120 s
# Once, and at the end: Linux 6.1's gpio-sim frees the interrupts of a chip that goes while they are requested, and
# giving them back then writes to memory of others.
. "$RIG/guest/daemon.sh"
gpio_up removed 8 3=REMOVED_TRIG_IN 4=REMOVED_READY 5=REMOVED_EXPOSURE
daemon_start 16 16 '[trigger]
source = "gpio"
line = "REMOVED_TRIG_IN"
rate_hz = 1
[camera]
exposure_us = 100000
[outputs]
trigger_ready = "REMOVED_READY"
exposure = "REMOVED_EXPOSURE"'
said=$(python3 "$RIG/programs/returns.py" $daemon 1 gpio /sys/kernel/config/gpio-sim/removed 3 frames 2>&1) || fail "$said: $(tail -n 5 daemon.log)"
figure "$said"
gpio_lines removed
wait_for 5 grep -q 'trigger_ready: the line is back' daemon.log
said=$(python3 "$RIG/programs/watch_lines.py" "$GPIO_LINES" 3 4 5 100 3 2>&1) || fail "after the return: $said: $(cat daemon.log)"
sleep 1 # the last frames are stored
daemon_stop
daemon_undisturbed file
