#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Installs the C client into a folder of the build and uses it from there, through CMake and through pkg-config; the shared
library exports what its header declares, each with a version, and nothing else.

Usage: installed_client_test.py SOURCE BUILD CMAKE CC CXX NM
"""
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

source, build = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
cmake, cc, cxx, nm = sys.argv[3:7]
work = build / "installed_client_test"
prefix = work / "prefix"


def run(*command):
    subprocess.check_call([str(word) for word in command])


shutil.rmtree(work, ignore_errors=True)
run(cmake, "--install", build, "--component", "client", "--prefix", prefix)
library = next(prefix.rglob("libobscura-client.so"))
header = (prefix / "include/obscura_client.h").read_text()
declared = set(re.findall(r"OBSCURA_API [^;(]*?\b(obscura_\w+)\(", header))
exported = dict(line.split()[-1].split("@@") for line in subprocess.check_output([nm, "-D", "--defined-only", library], text=True).splitlines() if " T " in line)
if len(declared) < 50 or set(exported) != declared:
    sys.exit(f"declared, but not exported: {declared - set(exported)}; exported, but not declared: {set(exported) - declared}")
if set(exported.values()) != {"OBSCURA_CLIENT_1.0", "OBSCURA_CLIENT_1.1", "OBSCURA_CLIENT_1.2"} or exported["obscura_next"] != "OBSCURA_CLIENT_1.1":
    sys.exit(f"versions of symbols: {set(exported.values())}")

run(cmake, "-S", source / "tests/clients/consumer", "-B", work / "consumer", "-G", "Ninja", f"-DCMAKE_C_COMPILER={cc}",
    f"-DCMAKE_CXX_COMPILER={cxx}", f"-DCMAKE_PREFIX_PATH={prefix}", f"-DEXAMPLES={source / 'clients'}")
run(cmake, "--build", work / "consumer")
# The file names the prefix of the configuration; what is installed elsewhere says so itself.
flags = shlex.split(subprocess.check_output(
    ["pkg-config", f"--define-variable=prefix={prefix}", "--cflags", "--libs", "obscura-client"], text=True,
    env={**os.environ, "PKG_CONFIG_PATH": str(library.parent / "pkgconfig")}))
run(cc, "-std=c11", "-Wall", "-Wextra", "-Werror", source / "clients/c/examples/first.c", *flags, "-lm", "-o", work / "first")
run(cxx, "-std=c++17", "-Wall", "-Wextra", "-Werror", source / "clients/cpp/examples/first.cpp", *flags, "-o", work / "first_cpp")
# The program that the section of the page begins with
page = (source / "docs/clients.md").read_text().split("\n### C and C++\n\n")[1].split("\n\n`")[0]
(work / "page.cpp").write_text("".join(line[4:] + "\n" for line in page.splitlines()))
run(cxx, "-std=c++17", "-Wall", "-Wextra", "-Werror", work / "page.cpp", *flags, "-o", work / "page")
for program in work / "page", work / "first", work / "first_cpp", work / "consumer/first_c", work / "consumer/first_cpp":
    done = subprocess.run([program], env={**os.environ, "OBSCURA": "/nowhere", "LD_LIBRARY_PATH": str(library.parent)},
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode == 0 or "environment variable OBSCURA" not in done.stdout:
        sys.exit(f"FAILED: {program}: {done.returncode} {done.stdout}")
print(f"{len(declared)} functions, and programs in C and C++ on the installed client: good")
shutil.rmtree(work)
