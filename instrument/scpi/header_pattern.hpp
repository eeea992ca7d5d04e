// SPDX-License-Identifier: Apache-2.0
// Header of a SCPI command in long and short form, with optional nodes and a numeric suffix.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::instrument {

/// A header as the standard writes it: "[CAMera#:]TRIGger[:SEQuence]:SOURce". Capitals are the short form,
/// "[]" what may be left out, "#" where a number may stand.
class HeaderPattern {
public:
    explicit HeaderPattern(std::string_view pattern);

    /// The numeric suffix, 1 where none is given, if the pattern names `header`, whose mnemonics are in upper
    /// case; else nullopt.
    [[nodiscard]] std::optional<std::uint32_t> match(std::span<const std::string> header) const;

private:
    struct Node {
        std::string long_form, short_form; ///< in upper case
        bool optional = false, numbered = false;
    };
    [[nodiscard]] bool fits(std::size_t node, std::span<const std::string> header,
                            std::uint32_t& suffix) const;

    std::vector<Node> nodes_;
};

/// Whether `text` is the long or the short form of a word such as "MINimum", in either case.
[[nodiscard]] bool is_form_of(std::string_view text, std::string_view pattern);

} // namespace obscura::instrument
