// SPDX-License-Identifier: Apache-2.0
// Results of a verb as a table or as one JSON object.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace obscura::tools {

/// Ordered list of named results. `key` is the JSON name, `label` the name in the table.
class Report {
public:
    void add(std::string_view key, std::string_view label, std::int64_t value);
    void add(std::string_view key, std::string_view label, std::string_view value);
    void add(std::string_view key, std::string_view label, bool value);
    /// A missing value is null in JSON and "-" in the table.
    void add(std::string_view key, std::string_view label, std::optional<double> value, std::string_view unit,
             int decimals);
    /// Adds a number with its own text for the table.
    void add(std::string_view key, std::string_view label, std::string text, double value);
    /// Adds a line to the table only, or an object, given as JSON text, to the JSON object only.
    void add_line(std::string_view label, std::string_view text);
    void add_object(std::string_view key, std::string_view json);

    [[nodiscard]] std::string table() const;
    [[nodiscard]] std::string json() const;
    /// Writes the table, or the JSON object, to standard output.
    void print(bool as_json) const;

private:
    struct Line {
        std::string key, label, text;
        std::variant<std::monostate, std::int64_t, double, bool, std::string> value;
    };
    struct Object {
        std::string key, json;
    };
    std::vector<Line> lines_; ///< without a key: in the table only
    std::vector<Object> objects_;
};

/// The `percent` percentile of `values` (nearest rank); nullopt if there are none.
[[nodiscard]] std::optional<double> percentile(std::vector<double> values, double percent);

} // namespace obscura::tools
