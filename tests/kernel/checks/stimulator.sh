# SPDX-License-Identifier: Apache-2.0
# USB stimulator: the transport to the reference device raw, LZ4, windows and whole frames
# lane: screen
# time limit: 240 s
STIMULATOR=1
. "$RIG/guest/stimulator.sh"
for mode in raw lz4 windows; do
    device_up --size 320x240
    stimulator_feed "$SERIAL" 320x240 $mode 30 >feed || fail "$mode: $(cat feed device)"
    device_down
    grep -q "screen $SCREEN\$" feed || fail "$mode: device shows $SCREEN, $(cat feed)"
    figure "$mode: $(cat feed)"
done
device_up --size 320x240 --full-update --plain
# Nothing compressed, so `raw`; a device without the extension cannot say what it showed.
stimulator_feed "$SERIAL" 320x240 raw 30 >feed || [ "$(grep -c 'sent 30 frames, 30 updates, 0 compressed.*dropped 0' feed)" = 1 ] ||
    fail "whole frames: $(cat feed device)"
device_down
grep -q "screen $SCREEN\$" feed || fail "whole frames: device shows $SCREEN, $(cat feed)"
