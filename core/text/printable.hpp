// SPDX-License-Identifier: Apache-2.0
// Text of files, devices and networks as messages may quote it: it must not set a terminal, forge a line or
// fill a screen.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace obscura {

/// Longest line of a message, in bytes of what it quotes.
inline constexpr std::size_t max_message_bytes = 2000;

/// `text` on one line, cut behind `limit` bytes ("..." then): tabs and line ends are blanks, other control
/// characters and bytes that are no UTF-8 are written as \x1B.
[[nodiscard]] std::string printable(std::string_view text, std::size_t limit = 120);

/// A message of one or more lines: its line ends stay, each line is made printable and cut behind
/// max_message_bytes.
[[nodiscard]] std::string for_terminal(std::string_view text);

/// Writes `message` and a line end to standard error, as for_terminal() makes it.
void print_message(std::string_view message);

} // namespace obscura
