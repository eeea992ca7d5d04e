// SPDX-License-Identifier: Apache-2.0
// Keys of TOML tables: one row per key, from which reading, range checks, printing and documentation come.
#pragma once

#include "config/document.hpp"
#include "core/enum_names.hpp"
#include "core/error.hpp"
#include "core/geometry.hpp"
#include "core/spectral_band.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace obscura::config {

/// A double kept in SI units and written in the file in another one: SI = file value * `si`.
struct Scaled {
    double* value = nullptr;
    double si = 1;
};
/// A file or folder; relative ones start from the folder of the file they stand in.
struct Path {
    std::string* value = nullptr;
    bool must_exist = true; ///< as a readable regular file
    bool optional = false;  ///< may be empty: no file
};
/// A word out of the key's choices, kept as something else.
struct Word {
    std::function<void(std::string_view)> set;
    std::function<std::string()> get;
};
/// A curve over wavelength: array of [nanometres, value] pairs, increasing in wavelength.
struct Curve {
    std::vector<SpectralPoint>* points = nullptr;
};

/// A fixed number of numbers, as an array.
struct Numbers {
    double* first = nullptr;
    std::size_t count = 0;
};

/// Polygons: array of faces, each an array of 3 or more corners [x, y, z].
struct Faces {
    std::vector<std::vector<Vec3>>* faces = nullptr;
};

/// Where the value of a key goes. The default is what is there before reading.
using Target =
    std::variant<bool*, std::int32_t*, std::uint32_t*, std::int64_t*, std::uint64_t*, double*, std::string*,
                 Vec3*, Quat*, Scaled, Path, Word, Curve, Numbers, std::vector<double>*, Faces>;

struct Range {
    double min = -std::numeric_limits<double>::infinity();
    double max = std::numeric_limits<double>::infinity();
};

/// One key of a table: where its value goes, and everything that is known of it. Made by key() and described
/// by the members that return a Key, one row for each key:
///     key("grace_us", &s.grace_us).unit("us").range(0, 1e7).help("...")
/// Names and texts are not copied: they outlive the key, as literals do.
class Key {
public:
    Key(std::string_view the_name, Target the_target) : name(the_name), target(std::move(the_target)) {}

    std::string_view name;
    Target target;

    /// Unit of the value in the file; empty: none.
    [[nodiscard]] Key unit(std::string_view text) && { return (unit_ = text, std::move(*this)); }
    /// Smallest and largest value in the file's unit, of each component.
    [[nodiscard]] Key range(double min, double max) && { return (range_ = {min, max}, std::move(*this)); }
    [[nodiscard]] Key range(const Range& range) && { return (range_ = range, std::move(*this)); }
    /// The words that a string may be. An enumeration's own names need not be listed.
    [[nodiscard]] Key choices(std::vector<std::string_view> words) && {
        return (choices_ = std::move(words), std::move(*this));
    }
    /// What the value means: a full phrase that is understood without the keys around it.
    [[nodiscard]] Key help(std::string_view text) && { return (help_ = text, std::move(*this)); }
    /// The table is refused without this key.
    [[nodiscard]] Key required() && { return (required_ = true, std::move(*this)); }
    /// A new value is taken on by a reload, while frames go on.
    [[nodiscard]] Key reloadable() && { return (reloadable_ = true, std::move(*this)); }

    /// Not part of an effective configuration: what it says stands there in another way.
    [[nodiscard]] Key unprinted() && { return (printed_ = false, std::move(*this)); }

    [[nodiscard]] std::string_view unit() const noexcept { return unit_; }
    [[nodiscard]] const Range& range() const noexcept { return range_; }
    [[nodiscard]] const std::vector<std::string_view>& choices() const noexcept { return choices_; }
    [[nodiscard]] std::string_view help() const noexcept { return help_; }
    [[nodiscard]] bool is_required() const noexcept { return required_; }
    [[nodiscard]] bool is_reloadable() const noexcept { return reloadable_; }
    [[nodiscard]] bool is_printed() const noexcept { return printed_; }

private:
    std::string_view unit_, help_;
    Range range_;
    std::vector<std::string_view> choices_;
    bool required_ = false, reloadable_ = false, printed_ = true;
};

/// A key whose value goes to `target`; the default is what is there before reading.
[[nodiscard]] inline Key key(std::string_view name, Target target) {
    return {name, std::move(target)};
}
/// A key whose words are the names of an enumeration (core/enum_names.hpp).
template<NamedEnum Enum>
[[nodiscard]] Key key(std::string_view name, Enum* target) {
    const auto set = [target](std::string_view word) {
        if (const auto value = enum_named<Enum>(word)) *target = *value;
    };
    const auto get = [target] { return std::string(name_of(*target)); };
    return Key(name, Word{set, get}).choices(names_of_enum<Enum>());
}

using Keys = std::vector<Key>;

/// What a table of a file is called in messages: its file and its dotted path ("" for the root).
struct Where {
    std::filesystem::path file;
    std::string path;

    [[nodiscard]] Where in(std::string_view key) const {
        return {file, path.empty() ? std::string(key) : path + "." + std::string(key)};
    }
};

/// Throws ConfigError `file:line:column: path: what`.
[[noreturn]] void fail(const Where& where, Position at, std::string_view what);

/// Where each key that was given stood.
using Given = std::map<std::string, Position, std::less<>>;

/// The same with one more word, for the absence of a value.
template<NamedEnum Enum>
[[nodiscard]] Key key(std::string_view name, std::optional<Enum>* target, std::string_view nothing) {
    const auto set = [target](std::string_view word) { *target = enum_named<Enum>(word); };
    const auto get = [target, nothing] { return std::string(*target ? name_of(**target) : nothing); };
    std::vector<std::string_view> words = names_of_enum<Enum>();
    words.insert(words.begin(), nothing);
    return Key(name, Word{set, get}).choices(std::move(words));
}
/// A truth value written as one of two words.
[[nodiscard]] inline Key key(std::string_view name, bool* target, std::string_view when_true,
                             std::string_view when_false) {
    const auto set = [=](std::string_view word) { *target = word == when_true; };
    const auto get = [=] { return std::string(*target ? when_true : when_false); };
    return Key(name, Word{set, get}).choices({when_true, when_false});
}

/// The mistakes found in a file so far, so that all of them are said at once. Not thread-safe.
class Mistakes {
public:
    void add(const Where& where, Position at, std::string_view what);
    /// Whole lines, as ConfigError has them; the same line twice counts once.
    void add(std::string text);
    /// Runs `read`; what it complains of by a ConfigError becomes a mistake. False when it did.
    template<typename F>
    bool collect(F&& read) {
        try {
            std::forward<F>(read)();
            return true;
        } catch (const ConfigError& error) {
            add(std::string(error.what()));
            return false;
        }
    }
    [[nodiscard]] std::size_t count() const noexcept { return lines_.size(); }
    /// Throws ConfigError with a line for each mistake, in the order in which they were found.
    void throw_if_any() const;

private:
    std::vector<std::string> lines_;
};

/// Reads the members of `table` into the targets of `keys`; a key that cannot be read leaves its target
/// alone. Keys of `elsewhere` (tables, or keys the caller reads itself) are passed over; any other key is a
/// mistake, with a suggestion, and so is a required key that is missing. With `annotated`, a value may also
/// stand as { value = ..., provenance = "...", source = "..." }.
Given read_keys(const Value& table, const Where& where, const Keys& keys, Mistakes& mistakes,
                const std::vector<std::string_view>& elsewhere = {}, bool annotated = false);

/// The same for tables that are read by themselves. Throws ConfigError with all mistakes.
Given read_keys(const Value& table, const Where& where, const Keys& keys,
                const std::vector<std::string_view>& elsewhere = {}, bool annotated = false);

/// The member tables of a table: `value` must be a table.
const Value& expect_table(const Value& value, const Where& where);

/// The tables of an array of tables [[name]]; `where` is the array's own.
const std::vector<Value>& expect_tables(const Member& member, const Where& where);

/// The first of the keys whose bound value lies outside of its range, for structs that were filled by a
/// program and not from a file: `key: value, allowed ...`; empty when all are within. Units are those of the
/// file.
[[nodiscard]] std::string explain_out_of_range(const Keys& keys);

/// The value of a key as TOML.
[[nodiscard]] std::string value_text(const Key& key);
/// Type of the key's value in the file: "integer", "number", "string", "array of 3 numbers [x, y, z]", ...
[[nodiscard]] std::string type_text(const Key& key);
/// What the value may be, beside its type: "1 to 64 px", "timer | none", ...
[[nodiscard]] std::string allowed_text(const Key& key);
/// `key = value  # help` lines of a table, wrapped for reading.
[[nodiscard]] std::string print_keys(const Keys& keys);
/// `text` as a TOML basic string.
[[nodiscard]] std::string toml_string(std::string_view text);

} // namespace obscura::config
