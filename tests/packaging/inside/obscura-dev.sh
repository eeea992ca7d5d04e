# SPDX-License-Identifier: Apache-2.0
# Runs in a bare Debian with obscura-dev, CMake and a compiler: builds a small program on the installed libraries.
set -euo pipefail
cmake -S /try/consumer -B /tmp/consumer -G Ninja -DCMAKE_BUILD_TYPE=Release >/tmp/consumer.log 2>&1 || { tail -n 20 /tmp/consumer.log; exit 1; }
cmake --build /tmp/consumer >/tmp/consumer.log 2>&1 || { tail -n 20 /tmp/consumer.log; exit 1; }
/tmp/consumer/consumer
echo "ok - a program on obscura-dev"
