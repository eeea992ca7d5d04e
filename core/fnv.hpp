// SPDX-License-Identifier: Apache-2.0
// FNV-1a, 64 bit: hash for keys that are not adversarial.
#pragma once

#include <cstdint>
#include <string_view>

namespace obscura {

/// Hash of bytes, going on from that of those before (http://www.isthe.com/chongo/tech/comp/fnv).
[[nodiscard]] constexpr std::uint64_t fnv1a(std::string_view bytes,
                                            std::uint64_t before = 0xcbf29ce484222325) noexcept {
    for (const char c : bytes)
        before = (before ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    return before;
}

} // namespace obscura
