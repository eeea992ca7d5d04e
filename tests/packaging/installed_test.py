#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Installs the libraries into a folder of the build and uses them from there, as a program outside the tree does:
public headers include nothing but public headers, all of them compile, and tests/packaging/consumer builds and runs.
Usage: installed_test.py SOURCE BUILD CMAKE CXX"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

source, build, cmake, cxx = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3], sys.argv[4]
work = build / "installed_test"
prefix = work / "prefix"
include = prefix / "include/obscura"


def run(*command, **options):
    done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    if done.returncode != 0:
        sys.exit(f"FAILED: {' '.join(str(c) for c in command)}\n{done.stdout[-6000:]}")
    return done.stdout


shutil.rmtree(work, ignore_errors=True)
# Links instead of copies: the libraries have 200 MB.
run(cmake, "--install", build, "--component", "development", "--prefix", prefix,
    env={**os.environ, "CMAKE_INSTALL_MODE": "ABS_SYMLINK"})

complaints = []
headers = sorted(include.rglob("*.hpp"))
if not headers:
    sys.exit("no header was installed")
for header in headers:
    for number, line in enumerate(header.read_text().splitlines(), 1):
        match = re.match(r'#include "([^"]+)"', line)
        if match and not (include / match[1]).exists():
            complaints.append(f"{header.relative_to(include)}:{number}: public, but {match[1]} is not: add that to "
                              "obscura_public_headers() of its library")
if complaints:
    sys.exit("\n".join(complaints))

every = work / "every_header.cpp"
every.write_text("".join(f'#include "{header.relative_to(include)}"\n' for header in headers))
run(cxx, "-std=c++20", "-Wall", "-Wextra", "-fsyntax-only", "-I", include, every)

# The generator and the compiler cache are those of the machine; only the libraries come from the build.
run(cmake, "-S", source / "tests/packaging/consumer", "-B", work / "consumer", "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={cxx}",
    f"-DCMAKE_PREFIX_PATH={prefix}")
run(cmake, "--build", work / "consumer")
print(run(work / "consumer/consumer", source / "config/scenes/demo.toml").strip())
print(f"{len(headers)} public headers and a program on the installed libraries: good")
shutil.rmtree(work)
