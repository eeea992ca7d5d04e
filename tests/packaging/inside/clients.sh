# SPDX-License-Identifier: Apache-2.0
# Runs in a bare Debian with obscura and the packages of its clients: each makes a picture by a server of its own.
# Exit status 0 only if all did.
set -uo pipefail
failed=0
cd /tmp || exit 1
# try LANGUAGE COMMAND...: the command writes LANGUAGE.png.
try() {
    local language=$1 output
    shift
    if output=$("$@" 2>&1) && [ "$(head -c 4 "$language.png" | tail -c 3)" = PNG ]; then
        echo "ok - $language"
    else
        failed=1
        printf 'NOT OK - %s\n%s\n' "$language" "$output"
    fi
}
try python /usr/bin/python3 -c 'import obscura_client; obscura_client.start("demo").render(size=(64, 64)).save("python.png")'
try lua lua5.4 -e 'require("obscura").start("demo"):render({ width = 64, height = 64 }):save("lua.png")'
# Their files only: Java's runtime and Octave are ten times as large as all of this.
has() {
    if dpkg-deb -c /packages/"$1"_*.deb | grep "$2" >/dev/null; then echo "ok - $1"; else
        failed=1
        echo "NOT OK - $1 lacks $2"
    fi
}
has libobscura-java usr/share/java/obscura-client.jar
has octave-obscura obscura_mex.mex
exit $failed
