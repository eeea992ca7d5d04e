# SPDX-License-Identifier: Apache-2.0
# Pulses on simulated GPIO to the real daemon in ExposureMode TriggerWidth: exposed for as long as each lasts
# lane: clocks
# time limit: 120 s
. "$RIG/guest/daemon.sh"
gpio_up pulse 8 3=PULSE_IN
daemon_start 16 16 '[trigger]
source = "gpio"
line = "PULSE_IN"
edge = "both"
rate_hz = 1
[camera]
trigger_activation = "RisingEdge"
exposure_mode = "TriggerWidth"'
said=$(python3 "$RIG/programs/pulses.py" "$GPIO_LINES/sim_gpio3/pull" frames 20 150 70 400 2>&1) || fail "$said: $(cat daemon.log)"
figure "$said"
daemon_stop
gpio_down pulse
