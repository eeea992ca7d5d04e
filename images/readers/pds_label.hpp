// SPDX-License-Identifier: Apache-2.0
// PDS3 labels (Planetary Data System, Standards Reference v3.8, chapter 12): keywords and values.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::images {

/// Statements of a label. Keywords inside OBJECT = IMAGE have names such as "IMAGE.LINES"; of repeated
/// objects the first applies.
class PdsLabel {
public:
    /// Reads a label that is `file` itself (detached) or its beginning (attached). Throws InputError
    /// `file:line: what`.
    explicit PdsLabel(const std::filesystem::path& file);

    [[nodiscard]] const std::filesystem::path& file() const { return file_; }
    [[nodiscard]] bool has(std::string_view key) const { return values_.find(key) != values_.end(); }
    /// The value without quotes and unit; a list keeps its parentheses. Throws InputError when the keyword is
    /// missing.
    [[nodiscard]] const std::string& text(std::string_view key) const;
    [[nodiscard]] std::string text(std::string_view key, std::string_view fallback) const;
    [[nodiscard]] std::int64_t integer(std::string_view key) const;
    [[nodiscard]] std::int64_t integer(std::string_view key, std::int64_t fallback) const;
    [[nodiscard]] double number(std::string_view key, double fallback) const;
    /// The elements of a list; a single value is a list of one.
    [[nodiscard]] std::vector<std::string> list(std::string_view key) const;
    /// The unit of the value in upper case; empty: none.
    [[nodiscard]] std::string unit(std::string_view key) const;

private:
    std::filesystem::path file_;
    std::map<std::string, std::string, std::less<>> values_; ///< raw
};

} // namespace obscura::images
