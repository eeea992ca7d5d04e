# USB stimulator: the transport to the reference device raw, LZ4 and windows; the kernel's gud driver as referee
# lane: usb
# time limit: 240 s
. "$RIG/guest/stimulator.sh"

# --- the transport against the reference device
for mode in raw lz4 windows; do
    device_up --size 320x240
    stimulator_feed 320x240 $mode 30 >feed || fail "$mode: $(cat feed device)"
    device_down
    grep -q "screen $SCREEN\$" feed || fail "$mode: device shows $SCREEN, $(cat feed)"
    figure "$mode: $(cat feed)"
done
device_up --size 320x240 --full-update --plain
# Nothing compressed, so `raw`; a device without the extension cannot say what it showed.
stimulator_feed 320x240 raw 30 >feed || [ "$(grep -c 'sent 30 frames, 30 updates, 0 compressed.*dropped 0' feed)" = 1 ] ||
    fail "whole frames: $(cat feed device)"
device_down
grep -q "screen $SCREEN\$" feed || fail "whole frames: device shows $SCREEN, $(cat feed)"

# --- the kernel's driver against the reference device
load gud
echo 0 >/sys/module/gud/parameters/async_flush
for lz4 in "" --no-lz4; do
    device_up --size 256x192 $lz4
    wait_for 10 test -c /dev/dri/card0 || fail "no card: $(cat device)"
    for console in /sys/class/vtconsole/vtcon*/bind; do echo 0 >"$console" || true; done # fbcon would draw too
    mkfifo /tmp/hold # the shared folder takes none
    drm_draw /dev/dri/card0 20 </tmp/hold >host &
    DRAW=$!
    exec 7>/tmp/hold
    wait_for 20 grep -q '^drew' host || fail "drm_draw: $(cat host device)"
    sleep 0.5
    kill $DEVICE # its screen is saved while the picture is still there
    wait $DEVICE || fail "device: $(cat device)"
    exec 7>&-
    wait $DRAW || fail "drm_draw: $(cat host)"
    rm /tmp/hold
    SCREEN=$(sed -n 's/^end:.* screen crc //p' device)
    grep -q "screen $SCREEN\$" host || fail "gud.ko: device shows $SCREEN, $(cat host device)"
    # The driver compresses what gets smaller by it.
    grep -c ' LZ4 ' device >compressed || true
    [ "$(cat compressed)" -gt 0 ] || [ -n "$lz4" ] || fail "gud.ko compressed nothing: $(cat device)"
    figure "gud.ko${lz4:+ without LZ4}: $(cat host)"
done
# Away again: it would take the device between the next check's daemons and draw a console on it.
rmmod gud
