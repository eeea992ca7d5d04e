// SPDX-License-Identifier: Apache-2.0
// Copies to and from memory that another thread or process reads or writes meanwhile, by relaxed 64-bit
// words.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace obscura::transports {

/// Copies `bytes` to shared memory at a multiple of 8, up to the end of the last word.
inline void write_words(std::byte* shared, const void* own, std::size_t bytes) noexcept {
    const auto* from = static_cast<const std::byte*>(own);
    for (std::size_t at = 0; at < bytes; at += 8) {
        std::uint64_t word = 0;
        std::memcpy(&word, from + at, std::min<std::size_t>(8, bytes - at));
        __atomic_store_n(reinterpret_cast<std::uint64_t*>(shared + at), word, __ATOMIC_RELAXED);
    }
}

/// Sets bytes [from, to) of shared memory at a multiple of 8 to 0, and those up to the end of the last word.
inline void clear_words(std::byte* shared, std::size_t from, std::size_t to) noexcept {
    for (std::size_t at = (from + 7) / 8 * 8; at < to; at += 8)
        __atomic_store_n(reinterpret_cast<std::uint64_t*>(shared + at), std::uint64_t{0}, __ATOMIC_RELAXED);
}

/// Copies `bytes` from shared memory at a multiple of 8.
inline void read_words(void* own, const std::byte* shared, std::size_t bytes) noexcept {
    auto* to = static_cast<std::byte*>(own);
    for (std::size_t at = 0; at < bytes; at += 8) {
        const std::uint64_t word =
            __atomic_load_n(reinterpret_cast<const std::uint64_t*>(shared + at), __ATOMIC_RELAXED);
        std::memcpy(to + at, &word, std::min<std::size_t>(8, bytes - at));
    }
}

} // namespace obscura::transports
