// PDS3 labels (Planetary Data System, Standards Reference v3.8, chapter 12): keywords and values.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::images {

/// The statements of a label. Keywords inside OBJECT = IMAGE are found as "IMAGE.LINES"; where an object
/// stands several times the first counts.
class PdsLabel {
public:
    /// Reads the label that `file` is or begins with. Throws InputError `file:line: what`.
    explicit PdsLabel(const std::filesystem::path& file);

    [[nodiscard]] const std::filesystem::path& file() const { return file_; }
    [[nodiscard]] bool has(std::string_view key) const { return values_.find(key) != values_.end(); }
    /// The value as it stands, quotes and units removed; a list keeps its parentheses. Throws InputError when
    /// it is not there.
    [[nodiscard]] const std::string& text(std::string_view key) const;
    [[nodiscard]] std::string text(std::string_view key, std::string_view fallback) const;
    [[nodiscard]] std::int64_t integer(std::string_view key) const;
    [[nodiscard]] std::int64_t integer(std::string_view key, std::int64_t fallback) const;
    [[nodiscard]] double number(std::string_view key, double fallback) const;
    /// The elements of a list, or the one value.
    [[nodiscard]] std::vector<std::string> list(std::string_view key) const;
    /// The unit that followed the value, upper case; empty: none.
    [[nodiscard]] std::string unit(std::string_view key) const;

private:
    std::filesystem::path file_;
    std::map<std::string, std::string, std::less<>> values_; ///< raw
};

} // namespace obscura::images
