#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds the packaging to the project: same version, and every library that the build needs is in debian/control."""
import fnmatch
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
complaints = []

needed, optional = [], []
for line in (ROOT / "scripts/packages.txt").read_text().splitlines():
    # The section [tests] is no part of a package's build.
    if line.startswith("[tests]"):
        break
    line = line.split("#")[0].strip()
    # Every package build has a compiler. What is optional here is built into packages of its own there.
    if line.startswith("?"):
        if line != "?ccache":
            optional.append(line[1:])
    elif line and not line.startswith("[") and line not in {"g++", "python3", "aravis-tools-cli"}:
        needed.append(line)
control = (ROOT / "debian/control").read_text()


def listed(field, after=""):
    text = re.search(rf"^{field}:((?:.*\n)(?:[ \t].*\n)*)", control[control.index(after) :], re.MULTILINE)[1]
    return {re.split(r"[ (:]", item.strip())[0] for item in text.replace("\n", " ").split(",")}


build = listed("Build-Depends")
for package in needed + optional:
    if package not in build:
        complaints.append(f"debian/control: Build-Depends lacks {package} of scripts/packages.txt")
development = listed("Depends", "Package: obscura-dev")
programs_only = {"libboost-dev", "libcurl4-openssl-dev"}  # of which no installed library knows
for package in needed:
    if package.endswith("-dev") and package not in development | programs_only:
        complaints.append(f"debian/control: Depends of obscura-dev lacks {package} of scripts/packages.txt")

# cmake/Dependencies.cmake is installed: what it requires, a program that uses obscura-dev must find.
for module in re.findall(r"^pkg_check_modules\(\w+ REQUIRED (?:IMPORTED_TARGET )?([\w.+-]+)\)", (ROOT / "cmake/Dependencies.cmake").read_text(), re.MULTILINE):
    folder = subprocess.run(["pkg-config", "--variable=pcfiledir", module], capture_output=True, text=True).stdout.strip()
    owner = subprocess.run(["dpkg", "-S", f"{folder}/{module}.pc"], capture_output=True, text=True).stdout.partition(":")[0]
    if owner and owner not in development:
        complaints.append(f"debian/control: Depends of obscura-dev lacks {owner}, whose {module}.pc cmake/Dependencies.cmake requires")

# Each program and unit is in the list of one package: lists of whole folders would put it into two.
programs = [name for lists in [*ROOT.glob("*/**/CMakeLists.txt"), *ROOT.glob("cmake/*.cmake")] if lists.relative_to(ROOT).parts[0] != "build"
            for name in re.findall(r"install\(TARGETS ([a-z-]+) RUNTIME(?! DESTINATION \"\${CMAKE_INSTALL_LIBEXECDIR})", lists.read_text())]
installed = [line for file in (ROOT / "debian").glob("*.install") for line in file.read_text().split()]
for path in [f"usr/bin/{name}" for name in programs]:
    if installed.count(path) != 1:
        complaints.append(f"debian/: {path} is in {installed.count(path)} of the lists *.install, wanted one")
units = [re.sub(r"\.in$", "", file.name) for file in (ROOT / "systemd").glob("*.service*")]
for unit in units:
    found = [line for line in installed if fnmatch.fnmatch(f"lib/systemd/system/{unit}", line)]
    if len(found) != 1:
        complaints.append(f"debian/: lib/systemd/system/{unit} is in {len(found)} of the lists *.install, wanted one")

project = re.search(r"project\(obscura VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
package = re.match(r"obscura \(([^)]+)\)", (ROOT / "debian/changelog").read_text())[1]
if re.split(r"[-~+]", package)[0] != project:
    complaints.append(f"debian/changelog: version {package}, CMakeLists.txt: {project}")

print("\n".join(complaints) or "the packaging agrees with the project")
sys.exit(1 if complaints else 0)
