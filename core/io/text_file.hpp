// SPDX-License-Identifier: Apache-2.0
// Text files from any system: byte order marks, ends of lines and padding made alike.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace obscura {

/// Makes `text` plain: without a byte order mark of UTF-8, with LF at the ends of lines (CR and CR LF are
/// others' ends), without the NUL bytes and the SUB (Ctrl-Z) that pad its end. Lines keep their numbers.
/// Returns why it is no text that can be read, or an empty string: UTF-16 and UTF-32, a NUL byte within the
/// text.
[[nodiscard]] std::string make_plain_text(std::string& text);

/// `text` without a byte order mark of UTF-8.
[[nodiscard]] std::string_view without_byte_order_mark(std::string_view text) noexcept;

/// Whether a file is one of those that a scene is made of, see InputRecord.
enum class InputKind : bool { scene, system };

/// Reads a regular file of at most `max_bytes` and makes it plain. Returns an empty string, or why it could
/// not be read. Notes a file of a scene for InputRecord.
[[nodiscard]] std::string read_plain_text(const std::filesystem::path& file, std::size_t max_bytes,
                                          std::string& text, InputKind kind = InputKind::scene);

} // namespace obscura
