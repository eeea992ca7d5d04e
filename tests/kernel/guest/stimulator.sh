# SPDX-License-Identifier: Apache-2.0
# For checks with a USB stimulator: the reference device on a simulated USB bus. A check that sets STIMULATOR (0, 1) before it
# reads this has a bus and a device of that number; both may be used at once, the device's serial number is $SERIAL.
PATH=$RIG_BUILD/tools/stimulator-sim:$PATH
modprobe -a libcomposite usb_f_fs
modprobe dummy_hcd is_high_speed=1 num=2
STIMULATOR=${STIMULATOR:-0}
SERIAL=RIG-$STIMULATOR
UDC=/sys/kernel/config/usb_gadget/rig-screen-$STIMULATOR/UDC

device_up() { # OPTION...
    obscura-stimulator-sim --name rig-screen-$STIMULATOR --controller dummy_udc.$STIMULATOR --serial "$SERIAL" --save shown "$@" >device 2>&1 &
    DEVICE=$!
    wait_for 10 grep -q '^plugged in' device || fail "device: $(cat device)"
}
device_down() {
    kill $DEVICE
    wait $DEVICE || fail "device: $(cat device)"
    grep -q '^refused' device && fail "device: $(cat device)"
    SCREEN=$(sed -n 's/^end:.* screen crc //p' device)
}
