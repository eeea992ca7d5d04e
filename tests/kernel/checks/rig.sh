# SPDX-License-Identifier: Apache-2.0
# The rig itself: simulated GPIO chip, PPS and PTP sources and the loopback driver are there and work
# lane: first
gpio_up rig-self 8 3=SELF_IN
gpiomon --num-events=4 --format='%e' "$GPIO_CHIP" 3 >edges &
monitor=$!
while kill -0 $monitor 2>/dev/null; do
    for level in up down; do echo pull-$level >"$GPIO_LINES/sim_gpio3/pull"; sleep 0.1; done
done
[ "$(sort edges | uniq -c | tr -s ' \n' ' ')" = " 2 0 2 1 " ] || fail "edges: $(cat edges)"
load pps-gpio
load rig_triggers
(sleep 0.5; echo 1 >/sys/kernel/debug/rig_triggers/pps) &
timeout 1 ppstest /dev/pps0 >pps || true
grep -q 'assert.*sequence: 1' pps || fail "no PPS event"
[ -c /dev/ptp0 ] || fail "no PTP clock"
rmmod rig_triggers
gpio_down rig-self
for flavour in "" newer; do
    loopback_up $flavour
    v4l2-ctl -d /dev/video10 --info | grep -m 1 'Video Output'
done
