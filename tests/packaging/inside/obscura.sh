# SPDX-License-Identifier: Apache-2.0
# Runs in a bare Debian that has what obscura depends on, as root and without a network: installs, looks, runs, purges.
# Prints one line a check; exit status 0 only if all passed.
set -uo pipefail
. "$(dirname "$0")/checks.sh"

# Everything that a package could leave behind. The package manager's own books are not residue.
snapshot() {
    find / -xdev \( -path /proc -o -path /dev -o -path /tmp -o -path /try -o -path /packages -o -path /var/lib/dpkg -o -path /var/cache \
        -o -path /var/log -o -path /var/lib/apt -o -path /var/lib/systemd/catalog -o -path '/etc/*-' -o -path /etc/.pwd.lock \) -prune -o -printf '%M %u %g %p\n' | sort -k4
    sed 's/^/passwd: /' /etc/passwd
    sed 's/^/group: /' /etc/group
}

deb=$(ls /packages/obscura_[0-9]*.deb)
snapshot >/tmp/before
check "dpkg installs it" dpkg -i "$deb"
check "dpkg has nothing to complain of" bash -c '[ -z "$(dpkg --audit)" ] && dpkg --verify obscura'

# Files
for file in /usr/bin/obscurad /usr/bin/obscura /etc/obscura/obscurad.toml /etc/security/limits.d/obscura.conf \
    /lib/systemd/system/obscurad.service /lib/systemd/system/obscurad@.service /lib/systemd/system/obscurad-modules.service \
    /lib/systemd/system/obscura-serve.service /lib/systemd/system/obscura-instrument.service /usr/lib/sysusers.d/obscura.conf \
    /usr/lib/tmpfiles.d/obscura.conf /usr/lib/sysctl.d/60-obscura.conf /usr/lib/modprobe.d/obscura.conf \
    /lib/udev/rules.d/60-obscura.rules /usr/share/obscura/demo.toml /usr/share/obscura/scenes/demo.toml /usr/share/obscura/examples/lockstep/camera.toml \
    /usr/share/man/man1/obscura.1.gz /usr/share/man/man1/obscura-instrument.1.gz /usr/share/man/man1/obscura-stimulator-sim.1.gz /usr/share/man/man5/obscurad.toml.5.gz /usr/share/man/man8/obscurad.8.gz \
    /usr/share/bash-completion/completions/obscura /usr/share/bash-completion/completions/obscurad \
    /usr/share/bash-completion/completions/obscura-instrument /usr/share/bash-completion/completions/obscura-stimulator-sim \
    /usr/share/doc/obscura/copyright /usr/share/doc/obscura/examples/txtime.conf; do
    [ -f "$file" ] || bad "$file is missing"
done
ok "files looked for"
wrong=$(dpkg -L obscura | while read -r f; do [ -d "$f" ] && [ ! -L "$f" ] || find "$f" -prune \( ! -user root -o ! -group root -o -perm /022 \) ! -type l -print; done)
[ -z "$wrong" ] && ok "all files belong to root, nobody else writes" || bad "owner or mode of: $wrong"
conffiles=$(dpkg-query -W -f='${Conffiles}' obscura | awk 'NF{print $1}' | sort | tr '\n' ' ')
[ "$conffiles" = "/etc/obscura/obscurad.toml /etc/security/limits.d/obscura.conf " ] && ok "conffiles" || bad "conffiles: $conffiles"
for page in obscura.1 obscura-stimulator-sim.1 obscurad.toml.5 obscurad.8; do
    check "manual page $page" bash -c "[ -z \"\$(man --warnings -E UTF-8 -l -Tutf8 -Z /usr/share/man/man${page##*.}/$page.gz 2>&1 >/dev/null)\" ]"
done
check "bash completes verbs" bash -c 'source /usr/share/bash-completion/completions/obscura; compopt() { :; }
    COMP_WORDS=(obscura "") COMP_CWORD=1; _obscura; [[ " ${COMPREPLY[*]} " == *" grab "* && " ${COMPREPLY[*]} " == *" render "* ]]'

# Account and folders
account=$(getent passwd obscura || true)
[[ $account == obscura:*:*:*:"Obscura camera":/var/lib/obscura:*nologin ]] && ok "account" || bad "account: $account"
[ "$(stat -c '%U:%G %a' /var/lib/obscura 2>&1)" = "obscura:obscura 750" ] && ok "state folder" || bad "state folder: $(stat -c '%U:%G %a' /var/lib/obscura 2>&1)"
[ "$(stat -c '%U:%G %a' /var/lib/obscura/frames 2>&1)" = "obscura:obscura 2770" ] && ok "frames folder" || bad "frames folder"

# Units
[ -L /etc/systemd/system/multi-user.target.wants/obscurad.service ] && ok "service enabled" || bad "service not enabled"
check "systemd-analyze verify" bash -c 'o=$(systemd-analyze --man=no --recursive-errors=no verify obscurad.service obscurad@north.service 2>&1); s=$?; echo "$o"; [ $s = 0 ] && [ -z "$o" ]'
for unit in obscurad.service obscurad@.service; do
    check "systemd-analyze security $unit" systemd-analyze --offline=true --threshold=20 --no-pager security "/lib/systemd/system/$unit"
    echo "    $(systemd-analyze --offline=true --no-pager security "/lib/systemd/system/$unit" | grep Overall)"
done

# As the unit would: its account, its limits, no capability.
limits=(prlimit --rtprio=90 --memlock=unlimited --nice=30)
"${limits[@]}" true 2>/dev/null || { echo "    limits cannot be raised on this machine: tried without"; limits=(); }
as_service() {
    "${limits[@]}" setpriv --reuid=obscura --regid=obscura --init-groups --bounding-set=-all --inh-caps=-all --no-new-privs \
        env HOME=/var/lib/obscura "$@"
}
cd /var/lib/obscura || exit 1
check "obscurad --check" as_service obscurad --check --config /etc/obscura/obscurad.toml
sed 's/rate_hz = 5/rate_hz = -5/' /etc/obscura/obscurad.toml >/tmp/bad.toml
chmod 644 /tmp/bad.toml
chmod 755 /tmp
message=$(as_service obscurad --check --config /tmp/bad.toml 2>&1)
status=$?
[ $status = 78 ] && [[ $message == /tmp/bad.toml:*rate_hz* ]] && ok "a bad file: $message" || bad "a bad file: status $status, $message"
check "obscura check" as_service obscura check /usr/share/obscura/demo.toml
check "obscura examples" obscura examples two-windows --copy /tmp/two-windows
check "a copied example" obscura check /tmp/two-windows/camera.toml
check "obscura new" bash -c 'obscura new camera /tmp/camera.toml && obscura check /tmp/camera.toml'
as_service mkdir -p /tmp/frames 2>/dev/null || install -d -o obscura -g obscura /tmp/frames
if obscura --help | grep '^ *capture ' >/dev/null; then
    check "obscura capture" as_service obscura capture /etc/obscura/obscurad.toml --frames 2 --output /tmp/frames
else
    bad "obscura has no verb capture"
fi

as_service obscurad --config /etc/obscura/obscurad.toml --ready-file /tmp/frames/ready 2>/tmp/frames/log &
for _ in $(seq 100); do
    [ -e /tmp/frames/ready ] && break
    sleep 0.1
done
check "the daemon is ready" test -e /tmp/frames/ready
daemon=$(grep -lx obscurad /proc/[0-9]*/comm 2>/dev/null | head -1 | cut -d/ -f3)
grep -E '^(CapEff|CapBnd|NoNewPrivs)' "/proc/${daemon:-self}/status" | tr '\n' ' ' | sed 's/^/    /'
echo
if obscura --help | grep '^ *grab ' >/dev/null; then
    check "five frames over GigE Vision" as_service obscura grab --address 127.0.0.1 --frames 5 --output /tmp/frames --format png
    [ "$(find /tmp/frames -name '*.png' -size +10k | wc -l)" -ge 5 ] && ok "pictures" || bad "pictures: $(ls -l /tmp/frames)"
else
    bad "obscura has no verb grab"
fi
if [ -n "$daemon" ]; then
    begin=$(date +%s%N)
    kill -TERM "$daemon"
    while kill -0 "$daemon" 2>/dev/null && [ $((($(date +%s%N) - begin) / 1000000)) -lt 5000 ]; do sleep 0.02; done
    took=$((($(date +%s%N) - begin) / 1000000))
    [ $took -lt 2000 ] && ok "stops in $took ms" || bad "stops in $took ms"
fi
[ $failed = 0 ] || sed 's/^/    daemon: /' /tmp/frames/log | tail -n 20
find /var/lib/obscura -mindepth 1 ! -name frames | sed 's/^/    state: /'

# A changed configuration outlives removal and a new installation; a purge takes everything.
echo '# changed by the operator' >>/etc/obscura/obscurad.toml
check "installing again" dpkg -i "$deb"
grep -q 'changed by the operator' /etc/obscura/obscurad.toml && ok "keeps the operator's configuration" || bad "configuration overwritten"
check "removing" dpkg -r obscura
{ [ -f /etc/obscura/obscurad.toml ] && [ ! -e /usr/bin/obscurad ]; } && ok "removal keeps the configuration only" || bad "removal"
check "installing over what was left" dpkg -i "$deb"
mkdir -p /var/lib/obscura-north
check "purging" dpkg -P obscura
snapshot >/tmp/after
if difference=$(diff /tmp/before /tmp/after); then ok "no residue"; else
    bad "residue:"
    printf '%s\n' "$difference" | sed 's/^/    /'
fi
exit $failed
