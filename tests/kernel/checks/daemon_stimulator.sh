# SPDX-License-Identifier: Apache-2.0
# GPIO edges, rising and falling, to the real daemon to the USB stimulator, raw, LZ4 and partial: a frame each, all on the screen
# lane: screen
# time limit: 400 s
. "$RIG/guest/daemon.sh"
STIMULATOR=1
. "$RIG/guest/stimulator.sh"
gpio_up screen 8 3=SCREEN_TRIG_IN
total=0
# Short exposures are all noise, in longer ones the moonlet is saturated and LZ4 has something to do.
run() { # NAME EDGES EDGE COMPRESSION EXPOSURE-US MORE [WINDOW...]
    local name=$1 edges=$2 edge=$3 compression=$4 exposure=$5 more=$6 said on=pull-up off=pull-down
    shift 6
    [ "$edge" = rising ] || on=pull-down off=pull-up
    echo $off >"$GPIO_LINES/sim_gpio3/pull"
    device_up --size 96x64
    daemon_start 96 64 "[trigger]
source = \"gpio\"
line = \"SCREEN_TRIG_IN\"
edge = \"$edge\"
over_trigger = \"latch\"
[camera]
exposure_us = $exposure
$more
[stimulator]
enabled = true
serial = \"$SERIAL\"
queue_frames = 64
dither = \"none\"
compression = \"$compression\"" 8
    wait_for 20 grep -q '^plugged in' device && wait_for 20 grep -q '^stimulator.*96x64' daemon.log || fail "no stimulator: $(cat daemon.log device)"
    said=$(python3 "$RIG/programs/fire_edges.py" "$GPIO_LINES/sim_gpio3/pull" frames 1 "$edges" $on $off 2>&1) || fail "$name: $said"
    ln -s device "device-$name"
    said=$(python3 "$RIG/programs/shown_frames.py" "device-$name" frames 96 64 "$edges" "$@" 2>&1) || fail "$name: $said"
    daemon_stop
    device_down
    mv device "device-$name"
    grep -q "stimulator: $edges delivered, 0 dropped" daemon.log || fail "$name: $(tail -n 1 daemon.log)"
    figure "$name: $said"
    total=$((total + edges))
}
run raw 70 rising off 200 ''
run lz4 70 falling always 500 ''
run windows 60 falling auto 200 '[[camera.window]]
width = 40
height = 16
offset_x = 8
offset_y = 4
[[camera.window]]
width = 40
height = 24
offset_x = 30
offset_y = 32' 40x16+8+4 40x24+30+32
figure "$total of $total edges, one frame each, all on the screen"
gpio_down screen
