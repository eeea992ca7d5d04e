# The real daemon on a timer to v4l2loopback: v4l2-ctl, ffmpeg and GStreamer get every pixel of its frames, stamps are edges
# lane: video
# time limit: 240 s
. "$RIG/guest/daemon.sh"
. "$RIG/guest/video.sh"
loopback_up newer
daemon_start 160 120 '[trigger]
rate_hz = 5
[v4l2]
enabled = true
frame_counter = true
buffers = 32'
for tool in v4l2-ctl ffmpeg gstreamer; do take_with $tool 160x120 Y16 6; done
daemon_stop
grep 'time stamps are the trigger edges' daemon.log || fail "no mmap"
for tool in v4l2-ctl ffmpeg gstreamer; do
    [ $tool = ffmpeg ] && stamps=stamps || stamps=
    said=$(python3 "$RIG/programs/compare_frames.py" $tool.raw frames 160 120 6 $stamps 2>&1) || fail "$tool: $said"
    say "$tool: $said"
done
figure "$(daemon_counters v4l2)"

# A node that is no output, and one that is not there: one line each, and the daemon lives and serves its files.
load vivid n_devs=1 node_types=0x1 num_inputs=1 vid_cap_nr=22
wait_for 5 test -c /dev/video22
for node in /dev/video22 /dev/video77 /dev/null; do
    daemon_start 160 120 "[trigger]
rate_hz = 5
[v4l2]
enabled = true
device = \"$node\""
    wait_for 10 test -s frames/frame_000003.toml || fail "the daemon does not live with $node"
    daemon_stop
    grep 'v4l2: /dev/' daemon.log
    [ "$(grep -c 'v4l2: /dev/' daemon.log)" = 1 ] || fail "not one line about $node: $(cat daemon.log)"
done
