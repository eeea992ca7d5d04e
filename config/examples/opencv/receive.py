#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Receives five frames of the camera on this machine and prints where the largest bright thing is in each."""
import cv2

camera = cv2.VideoCapture("aravissrc camera-name=127.0.0.1 num-buffers=5 ! video/x-raw,format=GRAY8 ! appsink", cv2.CAP_GSTREAMER)
for number in range(1, 6):
    good, image = camera.read()
    if not good:
        raise SystemExit(f"frame {number} did not come")
    _, mask = cv2.threshold(image, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    _, _, boxes, centres = cv2.connectedComponentsWithStats(mask)
    largest = 1 + boxes[1:, cv2.CC_STAT_AREA].argmax()
    x, y = centres[largest]
    print(f"frame {number}: {image.shape[1]} x {image.shape[0]}, asteroid at {x:.1f}, {y:.1f}, {boxes[largest, cv2.CC_STAT_AREA]} px")
camera.release()
