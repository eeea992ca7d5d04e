// SPDX-License-Identifier: Apache-2.0
// Errors and warnings of a model's text, each with line and column.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::models {

/// Place in a text, both from 1; the column counts bytes.
struct Place {
    int line = 1, column = 1;
    friend bool operator==(const Place&, const Place&) = default;
    friend bool operator<(const Place& a, const Place& b) {
        return a.line != b.line ? a.line < b.line : a.column < b.column;
    }
};

/// One error or warning.
struct Finding {
    Place at;
    bool error = true;
    std::string what; ///< one line without place, printable
};

/// Findings of one file. A place has at most one finding of a text; beyond `max_findings` errors the rest is
/// only counted. Thread-bound.
class Findings {
public:
    static constexpr std::size_t max_findings = 50;

    void error(Place at, std::string what) { add({at, true, std::move(what)}); }
    void warning(Place at, std::string what) { add({at, false, std::move(what)}); }
    [[nodiscard]] bool has_errors() const noexcept { return errors_ > 0; }
    /// Whether so many errors were found that reading on is of no use.
    [[nodiscard]] bool full() const noexcept { return errors_ >= max_findings; }
    /// In the order of their places.
    [[nodiscard]] std::vector<Finding> sorted() const;
    /// `file:line:column: what` for each error, or for each warning, one a line.
    [[nodiscard]] std::string text(std::string_view file, bool errors) const;

private:
    void add(Finding finding);
    std::vector<Finding> findings_;
    std::size_t errors_ = 0;
};

} // namespace obscura::models
