#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Judges the units as systemd itself does: exposure at most 2.0, no unknown setting, no capability, valid account.

Usage: units_test.py UNIT-DIRECTORY SOURCE-DIRECTORY SYSTEM-CONFIGURATION-DIRECTORY
Exit status 77 (skipped) where systemd's tools are not installed.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

units_folder, source, sysconf = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
if not shutil.which("systemd-analyze"):
    print("skipped: systemd-analyze is not installed")
    sys.exit(77)

complaints = []


def run(*command):
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return result.returncode, result.stdout


def settings(text, key):
    """All values of a setting; an empty one resets the list, as systemd does."""
    values = []
    for value in re.findall(rf"^{key}=(.*)$", text, re.MULTILINE):
        values = values + [value] if value else []
    return values


def judge(name, threshold=20):
    """Complains of what systemd's tools and the rules of all units complain of. Returns the text of the unit."""
    text = (units_folder / name).read_text()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        # The program is not installed while the tests run; any that exists serves the check of the rest.
        runnable = re.sub(r"^(Exec\w+=-?)\S+/obscura[-\w]*", r"\1/bin/true", text, flags=re.MULTILINE)
        copy = folder / name.replace("@", "@north")
        copy.write_text(runnable)
        status, output = run("systemd-analyze", "--offline=true", f"--threshold={threshold}", "--no-pager", "security", str(copy))
        level = re.search(r"Overall exposure level for \S+: ([\d.]+)", output)
        print(f"{name}: exposure {level[1] if level else '?'}")
        if status != 0 or not level:
            complaints.append(f"{name}: exposure above {threshold / 10}\n{output}")
        status, output = run("systemd-analyze", "--man=no", "--recursive-errors=no", "verify", str(copy))
        if status != 0 or output.strip():
            complaints.append(f"{name}: systemd-analyze verify says: {output}")

    if re.search(r"@[A-Z_]+@", text):
        complaints.append(f"{name}: a placeholder was left")
    for key in ["CapabilityBoundingSet", "AmbientCapabilities"]:
        if f"\n{key}=\n" not in text or settings(text, key):
            complaints.append(f"{name}: {key} must be there and empty")
    return text


for name in ["obscurad.service", "obscurad@.service"]:
    text = judge(name)
    for key, wanted in {
        "Type": "notify",
        "WatchdogSec": "5s",
        "ExecReload": "/bin/kill -HUP $MAINPID",
        "RestartPreventExitStatus": "78",
        "StartLimitIntervalSec": "0",
        "User": "obscura",
    }.items():
        if settings(text, key) != [wanted]:
            complaints.append(f"{name}: {key}={settings(text, key)}, wanted {wanted}")
    config = sysconf / "obscura" / ("%i.toml" if "@" in name else "obscurad.toml")
    program = settings(text, "ExecStart")
    check = settings(text, "ExecStartPre")
    if len(program) != 1 or not program[0].endswith(f"/obscurad --config {config}"):
        complaints.append(f"{name}: ExecStart={program} does not start the daemon with {config}")
    if len(check) != 1 or not check[0].endswith(f"/obscurad --check --config {config}"):
        complaints.append(f"{name}: ExecStartPre={check} does not check {config}")

# The rendering server: an account of its own, and only this machine can reach it.
serve = judge("obscura-serve.service")
for key, wanted in {"Type": "notify", "DynamicUser": "yes", "Group": "obscura", "IPAddressAllow": "localhost", "IPAddressDeny": "any"}.items():
    if settings(serve, key) != [wanted]:
        complaints.append(f"obscura-serve.service: {key}={settings(serve, key)}, wanted {wanted}")
if not settings(serve, "ExecStart")[0].endswith("/obscura serve --unix %t/obscura-serve/socket --root %S/obscura-serve"):
    complaints.append("obscura-serve.service: ExecStart does not start the server in its folders")

# The web server: as that one, with its tokens from the service manager, and less exposed still.
web = judge("obscura-web.service", 15)
for key, wanted in {"Type": "notify", "DynamicUser": "yes", "SupplementaryGroups": "obscura obscura-admin", "IPAddressAllow": "localhost", "IPAddressDeny": "any",
                    "MemoryMax": "256M", "RestrictRealtime": "yes", "MemoryDenyWriteExecute": "yes"}.items():
    if settings(web, key) != [wanted]:
        complaints.append(f"obscura-web.service: {key}={settings(web, key)}, wanted {wanted}")
credential = settings(web, "LoadCredential")
if credential != [f"tokens:{sysconf}/obscura/web-tokens"] or not settings(web, "ExecStart")[0].endswith("/obscura-web --tokens %d/tokens"):
    complaints.append("obscura-web.service: its tokens are not those of the configuration's folder")

# The instrument: as that one, without tokens.
instrument = judge("obscura-instrument.service", 15)
for key, wanted in {"Type": "notify", "DynamicUser": "yes", "SupplementaryGroups": "obscura", "IPAddressAllow": "localhost", "IPAddressDeny": "any",
                    "MemoryMax": "128M", "RestrictRealtime": "yes", "MemoryDenyWriteExecute": "yes"}.items():
    if settings(instrument, key) != [wanted]:
        complaints.append(f"obscura-instrument.service: {key}={settings(instrument, key)}, wanted {wanted}")

# Two services of one machine must not share a folder that systemd removes when one of them stops.
folders = [
    settings((units_folder / name).read_text(), "RuntimeDirectory")[0] for name in ["obscurad.service", "obscurad@.service"]
]
if folders[1].startswith(folders[0] + "/") or folders[0] == folders[1]:
    complaints.append(f"the runtime folders {folders} lie within one another")

# Groups that the unit and the rules name exist on Debian or come with the account.
groups = {"obscura", "video", "plugdev"}
rules = (source / "systemd/obscura.rules").read_text()
named = set(re.findall(r'GROUP="(\w+)"', rules))
for name in ["obscurad.service", "obscurad@.service"]:
    for line in settings((units_folder / name).read_text(), "SupplementaryGroups"):
        named |= set(line.split())
for group in sorted(named - groups):
    complaints.append(f"group {group} is used but nothing makes it")
# Every GOTO has its label and every line of the rules is complete (udevadm verify came after Debian 12).
if set(re.findall(r'GOTO="(\w+)"', rules)) != set(re.findall(r'LABEL="(\w+)"', rules)):
    complaints.append("obscura.rules: GOTO without LABEL")
term = r'(?:[A-Z]+(?:\{[\w/]+\})?(?:==|!=|=|\+=|:=)"(?:[^"\\]|\\.)*")'
for number, line in enumerate(rules.splitlines(), 1):
    if line and not line.startswith("#") and not re.fullmatch(rf"{term}(?:, {term})*", line):
        complaints.append(f"obscura.rules:{number}: not a rule: {line}")

if shutil.which("systemd-sysusers"):
    with tempfile.TemporaryDirectory() as root:
        status, output = run("systemd-sysusers", f"--root={root}", "--dry-run", str(source / "systemd/obscura.sysusers"))
        if status != 0 or "obscura" not in output:
            complaints.append(f"obscura.sysusers: {output}")

print("\n".join(complaints) or "the units pass")
sys.exit(1 if complaints else 0)
