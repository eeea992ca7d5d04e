# SPDX-License-Identifier: Apache-2.0
# GPIO edges with a jitter of 1 ms and a camera that turns at 1 deg/s: frames made ahead, stars and limb where the truth has them
# lane: last
# time limit: 400 s
. "$RIG/guest/daemon.sh"
count=60
gpio_up ahead 8 3=AHEAD_IN
python3 "$RIG/programs/ahead_scene.py" 180
cat >daemon.toml <<END
[scene]
file = "scene.toml"
[daemon]
seed = 5
pool_frames = 24
realtime = "off"
autostart = true
scene_time = "clock"
[render]
samples_per_pixel = 8
max_instants = 4
[deadline]
quality = "adapt"
[gige]
enabled = false
[file]
enabled = true
format = "raw"
directory = "frames"
queue_frames = 8
truth_table = true
[trigger]
source = "gpio"
line = "AHEAD_IN"
rate_hz = 1
over_trigger = "latch"
delay_us = 200000 # the emulated machine reprojects a hundred times slower
[camera]
exposure_us = 4000
[sensor]
pixel_pitch_um = 5.5
[sensor.readout]
width = 128
height = 96
shutter = "global"
[sensor.detector]
full_well_e = 2000000
gain_dn_per_e = 0.03
read_noise_e = 10
adc_bits = 16
END
daemon_run --timing timing.csv
chrt -f 60 python3 "$RIG/programs/jitter_edges.py" "$GPIO_LINES/sim_gpio3/pull" $count 1.0 0.001 || fail "the edges could not be fired"
wait_for 30 test -e "$(printf 'frames/frame_%06d.toml' $count)" || fail "no frame of the last edge: $(tail -n 3 daemon.log)"
daemon_stop
said=$(python3 "$RIG/programs/ahead_frames.py" frames timing.csv $count 1 2>&1) || fail "$said"
while read -r line; do figure "$line"; done <<<"$said"
gpio_down ahead
