# USB stimulator: 100 hot unplugs under load; back each time, picture whole, nothing leaks
# lane: usb
# time limit: 420 s
. "$RIG/guest/stimulator.sh"

device_up --size 160x120
stimulator_feed 160x120 unplug 100 $UDC "$(cat $UDC)" >feed 2>feed.err || fail "$(cat feed; tail -n 5 feed.err; tail -n 5 device)"
device_down
grep -q "screen $SCREEN\$" feed || fail "the device shows $SCREEN: $(cat feed)"
figure "$(cat feed)"
