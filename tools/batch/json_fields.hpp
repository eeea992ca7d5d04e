// SPDX-License-Identifier: Apache-2.0
// Members of untrusted JSON objects: types, ranges and unknown names, refused in one line.
#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>

namespace obscura::tools {

/// Parses `text`. Throws InputError `name:line:column: not valid JSON: ...`.
[[nodiscard]] nlohmann::json parse_json(std::string_view text, const std::string& name);

/// Reader of one object, which must outlive it. Every function throws InputError `file: place: cause, what is
/// allowed`.
class JsonFields {
public:
    /// `place`: dotted path of the object in the file; empty: the file itself.
    JsonFields(const nlohmann::json& object, std::string file, std::string place);

    [[nodiscard]] std::string text(std::string_view key);
    [[nodiscard]] std::uint64_t whole(std::string_view key, std::uint64_t least, std::uint64_t most);
    [[nodiscard]] double number(std::string_view key, double least, double most);
    [[nodiscard]] bool flag(std::string_view key);
    [[nodiscard]] JsonFields object(std::string_view key);
    /// Length of a list.
    [[nodiscard]] std::size_t list(std::string_view key);
    /// Object `index` of a list.
    [[nodiscard]] JsonFields element(std::string_view key, std::size_t index);
    /// Refuses members that were not read.
    void end() const;

    [[noreturn]] void refuse(std::string_view key, std::string_view what) const;

private:
    [[nodiscard]] const nlohmann::json& member(std::string_view key);
    [[nodiscard]] std::string place_of(std::string_view key) const;

    const nlohmann::json& object_;
    std::string file_, place_;
    std::set<std::string, std::less<>> read_;
};

} // namespace obscura::tools
