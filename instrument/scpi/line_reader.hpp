// SPDX-License-Identifier: Apache-2.0
// Lines of a byte stream, with a longest length.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace obscura::instrument {

/// Takes bytes and hands out lines without "\n" or "\r\n"; lines that are too long are thrown away.
class LineReader {
public:
    explicit LineReader(std::size_t longest) : longest_(longest) {}

    /// Bytes that have come; next() before more are given.
    void give(std::string_view bytes) { bytes_ = bytes; }

    /// A line, or the news that one was too long (nullopt inside); nothing when more bytes are wanted.
    [[nodiscard]] std::optional<std::optional<std::string>> next() {
        const std::size_t end = bytes_.find('\n');
        const std::string_view part = bytes_.substr(0, end);
        const bool ended = end != std::string_view::npos;
        bytes_.remove_prefix(ended ? end + 1 : bytes_.size());
        if (!too_long_ && line_.size() + part.size() > longest_) {
            too_long_ = true;
            line_.clear();
        }
        if (too_long_)
            thrown_away_ += part.size();
        else
            line_ += part;
        if (!ended) return std::nullopt;
        thrown_away_ = 0;
        if (std::exchange(too_long_, false)) return std::optional<std::optional<std::string>>(std::in_place);
        if (line_.ends_with('\r')) line_.pop_back();
        return std::exchange(line_, {});
    }
    /// Bytes of the present line that were thrown away.
    [[nodiscard]] std::size_t thrown_away() const noexcept { return thrown_away_; }

private:
    const std::size_t longest_;
    std::string line_;
    std::string_view bytes_;
    std::size_t thrown_away_ = 0;
    bool too_long_ = false;
};

} // namespace obscura::instrument
