// SPDX-License-Identifier: Apache-2.0
#include "tools/verbs/calls/calling_verb.hpp"

#include <fmt/format.h>

namespace obscura::tools {

int CallingVerb::run() {
    try {
        return work();
    } catch (const host::CallJson::exception& error) {
        throw HardwareError(
            fmt::format("obscura {}: the daemon's answer is not as expected: {}", name_, error.what()));
    }
}

} // namespace obscura::tools
