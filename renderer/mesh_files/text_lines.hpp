// SPDX-License-Identifier: Apache-2.0
// Line splitter for readers of mesh files in memory.
#pragma once

#include <algorithm>
#include <string_view>

namespace obscura::renderer {

/// Removes the first line from `text` and returns it without its line end.
inline std::string_view take_line(std::string_view& text) {
    const auto end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return line;
}

} // namespace obscura::renderer
