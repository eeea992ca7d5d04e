# For checks with a USB stimulator: the reference device on a simulated USB bus.
PATH=$RIG_BUILD/tools/stimulator-sim:$PATH
modprobe -a libcomposite usb_f_fs
modprobe dummy_hcd is_high_speed=1
UDC=/sys/kernel/config/usb_gadget/obscura-stimulator-sim/UDC

device_up() { # OPTION...
    obscura-stimulator-sim --save shown "$@" >device 2>&1 &
    DEVICE=$!
    wait_for 10 grep -q '^plugged in' device || fail "device: $(cat device)"
}
device_down() {
    kill $DEVICE
    wait $DEVICE || fail "device: $(cat device)"
    grep -q '^refused' device && fail "device: $(cat device)"
    SCREEN=$(sed -n 's/^end:.* screen crc //p' device)
}
