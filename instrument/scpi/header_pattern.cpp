// SPDX-License-Identifier: Apache-2.0
#include "instrument/scpi/header_pattern.hpp"

#include "core/text/text.hpp"

#include <algorithm>
#include <charconv>
#include <system_error>

namespace obscura::instrument {
namespace {

bool is_capital(char c) {
    return c >= 'A' && c <= 'Z';
}

std::string short_form_of(std::string_view pattern) {
    return std::string(pattern.begin(), std::find_if_not(pattern.begin(), pattern.end(), is_capital));
}

/// Takes the digits off the end of `text`: their value, 1 if there are none, 0 if they are too many.
std::uint32_t take_suffix(std::string_view& text) {
    const std::size_t last = text.find_last_not_of("0123456789");
    const std::string_view digits = text.substr(last == std::string_view::npos ? 0 : last + 1);
    if (digits.empty()) return 1;
    std::uint32_t value = 0;
    if (std::from_chars(digits.data(), digits.data() + digits.size(), value).ec != std::errc{}) value = 0;
    text.remove_suffix(digits.size());
    return value;
}

} // namespace

HeaderPattern::HeaderPattern(std::string_view pattern) {
    bool optional = false;
    std::string name;
    Node node;
    const auto finish = [&] {
        if (name.empty()) return;
        node.long_form = upper_case(name);
        node.short_form = short_form_of(name);
        nodes_.push_back(std::move(node));
        node = {};
        name.clear();
    };
    for (const char c : pattern) {
        switch (c) {
        case '[':
        case ']':
        case ':':
            finish();
            if (c != ':') optional = c == '[';
            break;
        case '#':
            node.numbered = true;
            break;
        default:
            node.optional = optional;
            name += c;
        }
    }
    finish();
}

bool HeaderPattern::fits(std::size_t node, std::span<const std::string> header, std::uint32_t& suffix) const {
    if (node == nodes_.size()) return header.empty();
    const Node& one = nodes_[node];
    if (!header.empty()) {
        std::string_view name = header.front();
        const std::uint32_t number = one.numbered ? take_suffix(name) : 1;
        if ((name == one.long_form || name == one.short_form) && fits(node + 1, header.subspan(1), suffix)) {
            if (one.numbered) suffix = number;
            return true;
        }
    }
    return one.optional && fits(node + 1, header, suffix);
}

std::optional<std::uint32_t> HeaderPattern::match(std::span<const std::string> header) const {
    std::uint32_t suffix = 1;
    return fits(0, header, suffix) ? std::optional(suffix) : std::nullopt;
}

bool is_form_of(std::string_view text, std::string_view pattern) {
    const std::string given = upper_case(text);
    return given == upper_case(pattern) || given == short_form_of(pattern);
}

} // namespace obscura::instrument
