// SPDX-License-Identifier: Apache-2.0
// Parsed TOML file: tree of values with their positions, independent of the TOML library.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::config {

/// Line and column in a text file, both from 1; 0: unknown.
struct Position {
    std::uint32_t line = 0, column = 0;
};

struct Member;

/// A TOML value. Only the field that `kind` names is meaningful.
struct Value {
    enum class Kind : std::uint8_t { boolean, integer, real, string, date, array, table };

    Kind kind = Kind::table;
    Position at;
    bool boolean = false;
    std::int64_t integer = 0;
    double real = 0;
    std::string string;
    std::vector<Value> items;    ///< array
    std::vector<Member> members; ///< table, in the order of the file

    [[nodiscard]] const Member* find(std::string_view key) const;
};

/// One `key = value` of a table.
struct Member {
    std::string key;
    Position at; ///< of the key
    Value value;
};

/// "an integer", "a table" and so on, for error messages.
[[nodiscard]] std::string_view kind_name(Value::Kind kind);

/// Reads and parses `file`. Throws ConfigError: `file: cannot be opened: why` or `file:line:column: ...`.
[[nodiscard]] Value parse_file(const std::filesystem::path& file);

/// Parses what is already in memory; `name` stands for the file in messages. Throws ConfigError.
[[nodiscard]] Value parse_text(std::string_view text, const std::string& name);

/// Reads a text file of at most 64 MiB. Returns an empty string, or why it could not be read.
[[nodiscard]] std::string read_text(const std::filesystem::path& file, std::string& text);

} // namespace obscura::config
