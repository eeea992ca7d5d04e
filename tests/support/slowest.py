#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the entries of a ctest run that took longest: slowest.py JUNIT.XML [COUNT]"""
import sys
import xml.etree.ElementTree

cases = xml.etree.ElementTree.parse(sys.argv[1]).getroot().iter("testcase")
times = sorted(((float(case.get("time", 0)), case.get("name")) for case in cases), reverse=True)
count = int(sys.argv[2]) if len(sys.argv) > 2 else 20
print(f"\nSlowest {min(count, len(times))} of {len(times)} entries, {sum(time for time, _ in times):.0f} s together:")
for time, name in times[:count]:
    print(f"{time:8.1f} s  {name}")
