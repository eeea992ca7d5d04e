# SPDX-License-Identifier: Apache-2.0
# The real daemon with a video node that is no output, one that is not there, one that is none: a line each, its files go on
# lane: screen
# time limit: 120 s
. "$RIG/guest/daemon.sh"
load vivid n_devs=1 node_types=0x1 num_inputs=1 vid_cap_nr=22
wait_for 5 test -c /dev/video22
for node in /dev/video22 /dev/video77 /dev/null; do
    daemon_start 32 24 "[trigger]
rate_hz = 5
[v4l2]
enabled = true
device = \"$node\""
    wait_for 10 test -s frames/frame_000003.toml || fail "the daemon does not live with $node"
    daemon_stop
    grep 'v4l2: /dev/' daemon.log
    [ "$(grep -c 'v4l2: /dev/' daemon.log)" = 1 ] || fail "not one line about $node: $(cat daemon.log)"
done
