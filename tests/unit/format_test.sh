#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Usage: format_test.sh CLANG-FORMAT. Fails, naming the places, when a source file is not laid out as .clang-format says.
cd "$(dirname "$0")/../.." || exit 1
# The kernel's modules have the kernel's layout.
find core config ephemeris images models terrain renderer sensors service sync transports host emulator serve instrument web tools clients tests \
    \( -name '*.hpp' -o -name '*.cpp' -o -name '*.[ch]' \) ! -path 'tests/kernel/modules/*' -print0 |
    xargs -0 "$1" --dry-run -Werror
