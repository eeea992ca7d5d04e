# SPDX-License-Identifier: Apache-2.0
# A video node removed and returned 100 times under the running V4L2 transport; the file transport beside it is undisturbed
# lane: screen
# time limit: 300 s
load vivid n_devs=1 node_types=0x100 num_outputs=1 output_types=1 vid_out_nr=21
wait_for 5 test -c /dev/video21
mkdir /run/removal
v4l2_removals --removals 100 --device /dev/video21 --files /run/removal --driver /sys/bus/platform/drivers/vivid \
    --name vivid.0 >removals.log 2>&1 || fail "$(tail -n 20 removals.log)"
grep '^files\|^node' removals.log
figure "$(tail -n 1 removals.log)"
[ "$(grep -c 'is gone' removals.log)" = 100 ] || fail "not one log line for each of 100 removals"
