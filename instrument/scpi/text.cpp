// SPDX-License-Identifier: Apache-2.0
#include "instrument/scpi/text.hpp"

#include <fmt/format.h>

#include <cmath>

namespace obscura::instrument {

std::string string_data(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"') result += c;
        result += c >= ' ' && c <= '~' ? c : '?';
    }
    return result + '"';
}

std::string number_text(double value) {
    if (std::isnan(value)) return "9.91E37";
    if (std::isinf(value)) return value > 0 ? "9.9E37" : "-9.9E37";
    return fmt::format("{}", value);
}

} // namespace obscura::instrument
