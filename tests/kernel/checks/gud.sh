# SPDX-License-Identifier: Apache-2.0
# The kernel's own gud driver draws on the reference device: an independent referee of what both take GUD to be
# lane: firstusb
# time limit: 120 s
# Before the others: the driver takes every such device, theirs as well.
. "$RIG/guest/stimulator.sh"
load gud
echo 0 >/sys/module/gud/parameters/async_flush
for lz4 in "" --no-lz4; do
    device_up --size 256x192 $lz4
    wait_for 10 test -c /dev/dri/card0 || fail "no card: $(cat device)"
    for console in /sys/class/vtconsole/vtcon*/bind; do echo 0 >"$console" || true; done # fbcon would draw too
    HOLD=$(mktemp -u) # the shared folder takes no FIFO, and /tmp shows the host's files
    mkfifo "$HOLD"
    drm_draw /dev/dri/card0 20 <"$HOLD" >host &
    DRAW=$!
    exec 7>"$HOLD"
    wait_for 20 grep -q '^drew' host || fail "drm_draw: $(cat host device)"
    sleep 0.5
    kill $DEVICE # its screen is saved while the picture is still there
    wait $DEVICE || fail "device: $(cat device)"
    exec 7>&-
    wait $DRAW || fail "drm_draw: $(cat host)"
    rm "$HOLD"
    SCREEN=$(sed -n 's/^end:.* screen crc //p' device)
    grep -q "screen $SCREEN\$" host || fail "gud.ko: device shows $SCREEN, $(cat host device)"
    # The driver compresses what gets smaller by it.
    grep -c ' LZ4 ' device >compressed || true
    [ "$(cat compressed)" -gt 0 ] || [ -n "$lz4" ] || fail "gud.ko compressed nothing: $(cat device)"
    figure "gud.ko${lz4:+ without LZ4}: $(cat host)"
done
rmmod gud
