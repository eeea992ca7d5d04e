# SPDX-License-Identifier: Apache-2.0
# GPIO edges to the real daemon to v4l2loopback to v4l2-ctl, ffmpeg and GStreamer: every edge, every pixel, stamps are the edges
# lane: video
# time limit: 400 s
. "$RIG/guest/daemon.sh"
. "$RIG/guest/video.sh"
gpio_up trigger 8 3=TRIG_IN
loopback_up newer
daemon_start 96 64 '[trigger]
source = "gpio"
line = "TRIG_IN"
over_trigger = "latch"
[v4l2]
enabled = true
frame_counter = true
buffers = 32'
fired=0
fire() { # COUNT | while=PID
    local said
    said=$(python3 "$RIG/programs/fire_edges.py" "$GPIO_LINES/sim_gpio3/pull" frames $((fired + 1)) "$1" 2>&1) || fail "$said"
    fired=$((fired + ${said%% *}))
}
# One after another: this driver has one reader at a time.
for tool in v4l2-ctl ffmpeg gstreamer; do
    take_with $tool 96x64 Y16 20 &
    reader=$!
    fire while=$reader
    wait $reader || fail "$tool saw too little: $(tail -n 3 $tool.log)"
    say "$tool has its images after $fired edges"
done
[ $fired -ge 200 ] || fire $((200 - fired))
daemon_stop
for tool in v4l2-ctl ffmpeg gstreamer; do
    [ $tool = ffmpeg ] && stamps=stamps || stamps=
    said=$(python3 "$RIG/programs/compare_frames.py" $tool.raw frames 96 64 20 $stamps 2>&1) || fail "$tool: $said"
    say "$tool: $said"
done
grep -q "^$fired triggers, $fired frames, $fired complete, .* 0 missed triggers, 0 dropped, .*v4l2: $fired delivered, 0 dropped" daemon.log ||
    fail "not one frame for each of $fired edges: $(tail -n 1 daemon.log)"
figure "$fired of $fired edges, one frame each, all delivered to the node"
gpio_down trigger
