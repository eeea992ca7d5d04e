// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/gpio_line_name.hpp"

#include <fmt/format.h>
#include <linux/gpio.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace obscura::sync {
namespace {

// One byte of the kernel's field is the terminating zero.
constexpr std::size_t max_name_bytes = GPIO_MAX_NAME_SIZE - 1;

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
    throw std::invalid_argument(
        fmt::format("GPIO line \"{}\": {}; allowed is a line's name or \"gpiochipN:OFFSET\"", text, why));
}

bool is_printable(const std::string& text) {
    return std::all_of(text.begin(), text.end(), [](char c) {
        const auto byte = static_cast<unsigned char>(c);
        return byte >= 0x20 && byte != 0x7f;
    });
}

} // namespace

GpioLineName parse_gpio_line(const std::string& text) {
    if (text.empty())
        throw std::invalid_argument("is missing, the name of a GPIO line or \"gpiochipN:OFFSET\" is wanted");
    if (!is_printable(text)) throw std::invalid_argument("a GPIO line's name has no control characters");
    const std::size_t colon = text.rfind(':');
    const std::string chip = text.substr(0, colon);
    const bool names_chip = chip.starts_with('/') || chip.starts_with("gpiochip");
    if (colon != std::string::npos && colon > 0) {
        const char* begin = text.data() + colon + 1;
        const char* end = text.data() + text.size();
        GpioLineName line{.device = chip.starts_with('/') ? chip : "/dev/" + chip};
        const auto [rest, error] = std::from_chars(begin, end, line.offset);
        if (error == std::errc() && rest == end) return line;
        if (names_chip) refuse(text, fmt::format("\"{}\" is not a line offset", std::string(begin, end)));
    } else if (names_chip) {
        refuse(text, "the line's offset in the chip is missing");
    }
    if (text.size() > max_name_bytes) refuse(text, fmt::format("longer than {} characters", max_name_bytes));
    return {.name = text};
}

} // namespace obscura::sync
