// SPDX-License-Identifier: Apache-2.0
// Text of messages as it may be written to a terminal.
#pragma once

#include <string>

namespace obscura {

/// `text` with blanks in place of control characters other than line ends: messages quote files and devices,
/// which must not set the terminal.
[[nodiscard]] inline std::string for_terminal(std::string text) {
    for (char& c : text)
        if ((static_cast<unsigned char>(c) < 0x20 && c != '\n') || c == 0x7F) c = ' ';
    return text;
}

} // namespace obscura
