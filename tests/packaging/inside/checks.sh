# SPDX-License-Identifier: Apache-2.0
# Checks of the scripts in this folder, one line each; read by them.
failed=0
ok() { echo "ok - $1"; }
bad() {
    echo "NOT OK - $1"
    failed=1
}
# check TEXT COMMAND...: the command succeeds; its output is shown if not.
check() {
    local text=$1 output
    shift
    if output=$("$@" 2>&1); then ok "$text"; else
        bad "$text"
        printf '%s\n' "$output" | tail -n 15 | sed 's/^/    /'
    fi
}
