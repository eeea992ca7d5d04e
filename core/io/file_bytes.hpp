// SPDX-License-Identifier: Apache-2.0
// A binary input file as a whole in memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

namespace obscura {

/// Bytes of a file, aligned for any number. A copy, not a mapping: a file that is cut while it is in use
/// would end the process (SIGBUS), and one that is written would change what was checked.
struct FileBytes {
    std::shared_ptr<const std::byte[]> bytes;
    std::size_t size = 0;

    [[nodiscard]] std::span<const std::byte> span() const noexcept { return {bytes.get(), size}; }
};

/// Reads a regular file; stops as check_reading() tells. Throws InputError, also where its size
/// changes meanwhile or memory does not suffice.
[[nodiscard]] FileBytes read_file_bytes(const std::filesystem::path& file);

} // namespace obscura
