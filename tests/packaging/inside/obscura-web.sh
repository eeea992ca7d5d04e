# SPDX-License-Identifier: Apache-2.0
# Runs in a bare Debian as root and without a network: obscura-web beside obscura, its page, and what it leaves behind.
# Prints one line a check; exit status 0 only if all passed.
set -uo pipefail
. "$(dirname "$0")/checks.sh"

check "dpkg installs it beside obscura" dpkg -i /packages/obscura_[0-9]*.deb /packages/obscura-web_*.deb
check "dpkg has nothing to complain of" bash -c '[ -z "$(dpkg --audit)" ] && dpkg --verify obscura-web'
for file in /usr/bin/obscura-web /lib/systemd/system/obscura-web.service /usr/share/man/man8/obscura-web.8.gz \
    /usr/share/bash-completion/completions/obscura-web /usr/share/doc/obscura-web/copyright; do
    [ -f "$file" ] && ok "$file" || bad "$file is missing"
done
check "manual page" bash -c '[ -z "$(man --warnings -E UTF-8 -l -Tutf8 -Z /usr/share/man/man8/obscura-web.8.gz 2>&1 >/dev/null)" ]'
[ ! -e /etc/systemd/system/multi-user.target.wants/obscura-web.service ] && ok "nothing starts it" || bad "it is enabled"
check "systemd-analyze verify" bash -c 'o=$(systemd-analyze --man=no --recursive-errors=no verify obscura-web.service 2>&1); s=$?; echo "$o"; [ $s = 0 ] && [ -z "$o" ]'
check "systemd-analyze security" systemd-analyze --offline=true --threshold=15 --no-pager security /lib/systemd/system/obscura-web.service
check "it makes tokens" bash -c 'obscura-web --tokens /etc/obscura/web-tokens --new-token viewer | grep -q "#token="'
check "the group that may use force exists, and the service belongs to it" bash -c 'getent group obscura-admin && grep -q "^SupplementaryGroups=.*\bobscura-admin\b" /lib/systemd/system/obscura-web.service && grep -q "^admin_group = \"obscura-admin\"" /etc/obscura/obscurad.toml'
setpriv --reuid=65534 --regid=65534 --groups="$(getent group obscura | cut -d: -f3)" obscura-web --listen 127.0.0.1:0 >/tmp/link &
web=$!
for _ in $(seq 100); do [ -s /tmp/link ] && break || sleep 0.1; done
port=$(sed 's|.*:\([0-9]*\)/.*|\1|' /tmp/link)
check "it answers, as another user" bash -c "exec 3<>/dev/tcp/127.0.0.1/$port && printf 'GET /livez HTTP/1.1\r\nHost: localhost:$port\r\nConnection: close\r\n\r\n' >&3 && grep -q '200 OK' <&3"
kill $web
wait $web && ok "it ends well" || bad "it ends with status $?"
rm -f /etc/obscura/web-tokens
check "dpkg removes it" dpkg --purge obscura-web
[ ! -e /usr/bin/obscura-web ] && [ -e /usr/bin/obscura ] && ok "obscura stays" || bad "wrong files are gone"
check "dpkg purges obscura" dpkg --purge obscura
exit $failed
