# SPDX-License-Identifier: Apache-2.0
# The real daemon's USB stimulator pulled out 100 times: back within 2 s, nothing leaks, every frame of the others is stored
# lane: usb
# time limit: 300 s
# The longest of all, and most of it is the kernel's own waits: it goes before those beside it.
renice -n -5 $$ >/dev/null
. "$RIG/guest/daemon.sh"
. "$RIG/guest/stimulator.sh"
device_up --size 32x24
daemon_start 32 24 '[trigger]
rate_hz = 11
over_trigger = "latch"
[camera]
exposure_us = 2000
[stimulator]
enabled = true
serial = "'"$SERIAL"'"
dither = "none"'
wait_for 30 grep -q '^update' device || fail "the screen shows nothing: $(cat daemon.log device)"
said=$(python3 "$RIG/programs/returns.py" $daemon 100 usb $UDC "$(cat $UDC)" device 2>&1) || fail "$said: $(tail -n 5 daemon.log)"
figure "$said"
daemon_stop
device_down
daemon_undisturbed file
figure "$(daemon_counters stimulator)"
