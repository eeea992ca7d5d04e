// SPDX-License-Identifier: Apache-2.0
// Elevation model files (.dem) of the published client: lines KEY = VALUE; that name a height map.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace obscura::serve {

/// One file: its keys in their order. Words without quotes are strings too.
class DemFile {
public:
    using Value = std::variant<double, std::string>;

    /// Throws InputError "FILE:LINE: what".
    [[nodiscard]] static DemFile read(const std::filesystem::path& file);
    /// `name` stands for the file in messages.
    [[nodiscard]] static DemFile parse(std::string_view text, const std::string& name);

    [[nodiscard]] const std::vector<std::pair<std::string, Value>>& keys() const noexcept { return keys_; }
    /// Throw InputError if the key is there and of the other type.
    [[nodiscard]] std::optional<double> number(std::string_view key) const;
    [[nodiscard]] std::string text(std::string_view key) const;
    /// What is wrong with it, with its name.
    [[nodiscard]] std::string mistake(std::string_view what) const;

private:
    [[nodiscard]] const Value* find(std::string_view key) const;

    std::string name_;
    std::vector<std::pair<std::string, Value>> keys_;
};

} // namespace obscura::serve
