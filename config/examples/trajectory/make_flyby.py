#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes flyby.csv: positions of a camera that passes the origin at 8 km on a straight line, every second for 40 s.
Usage: make_flyby.py [FILE]"""
import sys

SPEED_M_S, CLOSEST_M, DURATION_S = 600, 8000, 40

with open(sys.argv[1] if len(sys.argv) > 1 else "flyby.csv", "w", encoding="ascii") as table:
    table.write("time_s,x_m,y_m,z_m\n")  # four more columns qw,qx,qy,qz would give the attitude
    for time_s in range(DURATION_S + 1):
        table.write(f"{time_s},{-CLOSEST_M},{SPEED_M_S * (time_s - DURATION_S / 2):.0f},1500\n")
