#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Receives five frames of the camera on this machine as PNG files.
set -eu
gst-launch-1.0 -q aravissrc camera-name=127.0.0.1 num-buffers=5 ! video/x-raw,format=GRAY8 ! \
    pngenc snapshot=false ! multifilesink location=gst_%02d.png
echo "$(ls gst_*.png | wc -l) pictures: $(echo gst_*.png)"
