// SPDX-License-Identifier: Apache-2.0
// Names of files that are written beside another one and renamed to it once they are whole.
#pragma once

#include <filesystem>

namespace obscura {

/// A name in the folder of `target` that no other call, thread or process of this machine has:
/// `.NAME.PROCESS.NUMBER.tmp`.
[[nodiscard]] std::filesystem::path temporary_beside(const std::filesystem::path& target);

/// Removes files of such names beside `target` whose process runs no more: it was killed before it renamed
/// them. Only for files that one machine writes. What cannot be removed stays.
void remove_left_temporaries(const std::filesystem::path& target);

} // namespace obscura
