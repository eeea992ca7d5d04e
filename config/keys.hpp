// SPDX-License-Identifier: Apache-2.0
// Keys of TOML tables: one row per key, for reading, range checks, printing and documentation.
#pragma once

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/geometry.hpp"
#include "core/spectral_band.hpp"
#include "core/text/enum_names.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

namespace obscura::config {

/// A double kept in SI units that the file gives in another unit: SI = file value * `si`.
struct Scaled {
    double* value = nullptr;
    double si = 1;
};
/// Path of a file or folder; a relative one starts from the folder of the configuration file.
struct Path {
    std::string* value = nullptr;
    bool must_exist = true; ///< as a regular file
    bool optional = false;  ///< may be empty: no file
};
/// Files that exist: an array of names, or a single one (empty: none). Relative ones start from the folder of
/// the configuration file.
struct Files {
    std::vector<std::string>* files = nullptr;
};
/// One of the key's choices, kept as another type, such as an enumeration.
struct Word {
    std::function<void(std::string_view)> set;
    std::function<std::string()> get;
};
/// A curve over wavelength: an array of [nanometres, value] pairs with increasing wavelengths.
struct Curve {
    std::vector<SpectralPoint>* points = nullptr;
};

/// An array of a fixed number of numbers.
struct Numbers {
    double* first = nullptr;
    std::size_t count = 0;
};

/// Polygons: an array of faces, each an array of 3 or more corners [x, y, z].
struct Faces {
    std::vector<std::vector<Vec3>>* faces = nullptr;
};

/// Destination of a key's value. Its content before reading is the default.
using Target =
    std::variant<bool*, std::int32_t*, std::uint32_t*, std::int64_t*, std::uint64_t*, double*, std::string*,
                 Vec3*, Quat*, Scaled, Path, Files, Word, Curve, Numbers, std::vector<double>*, Faces>;

/// Smallest and largest value of a key, inclusive, in the unit of the file; by default unlimited.
struct Range {
    double min = -std::numeric_limits<double>::infinity();
    double max = std::numeric_limits<double>::infinity();
};

/// One key of a table: destination of its value, unit, range, choices and help. Made by key() and completed
/// by the members that return a Key, one row for each key:
///     key("grace_us", &s.grace_us).unit("us").range(0, 1e7).help("...")
/// Names and texts are not copied and must outlive the key, as literals do.
class Key {
public:
    Key(std::string_view the_name, Target the_target) : name(the_name), target(std::move(the_target)) {}

    std::string_view name;
    Target target;

    /// Unit of the value in the file; empty: none.
    [[nodiscard]] Key unit(std::string_view text) && { return (unit_ = text, std::move(*this)); }
    /// Smallest and largest value of each component.
    [[nodiscard]] Key range(double min, double max) && { return (range_ = {min, max}, std::move(*this)); }
    [[nodiscard]] Key range(const Range& range) && { return (range_ = range, std::move(*this)); }
    /// Allowed words of a string. key() sets those of an enumeration.
    [[nodiscard]] Key choices(std::vector<std::string_view> words) && {
        return (choices_ = std::move(words), std::move(*this));
    }
    /// Meaning of the value: a full phrase that is understood without the keys around it.
    [[nodiscard]] Key help(std::string_view text) && { return (help_ = text, std::move(*this)); }
    /// The table is refused without this key.
    [[nodiscard]] Key required() && { return (required_ = true, std::move(*this)); }
    /// The value may be a table instead, which the owner of the section reads.
    [[nodiscard]] Key or_table() && { return (or_table_ = true, std::move(*this)); }
    /// or_table() of a key that is printed: `text` gives the inline table, or nothing where the value counts.
    [[nodiscard]] Key or_table(std::function<std::string()> text) && {
        return (or_table_ = true, table_text_ = std::move(text), std::move(*this));
    }
    /// A reload accepts a new value without stopping the acquisition.
    [[nodiscard]] Key reloadable() && { return (reloadable_ = true, std::move(*this)); }
    /// Not part of an effective configuration, because other keys there have its effect.
    [[nodiscard]] Key unprinted() && { return (printed_ = false, std::move(*this)); }

    [[nodiscard]] std::string_view unit() const noexcept { return unit_; }
    [[nodiscard]] const Range& range() const noexcept { return range_; }
    [[nodiscard]] const std::vector<std::string_view>& choices() const noexcept { return choices_; }
    [[nodiscard]] std::string_view help() const noexcept { return help_; }
    [[nodiscard]] bool is_required() const noexcept { return required_; }
    [[nodiscard]] bool allows_table() const noexcept { return or_table_; }
    /// The inline table that stands in place of the value; empty: none does.
    [[nodiscard]] std::string table_text() const { return table_text_ ? table_text_() : std::string(); }
    [[nodiscard]] bool is_reloadable() const noexcept { return reloadable_; }
    [[nodiscard]] bool is_printed() const noexcept { return printed_; }

private:
    std::string_view unit_, help_;
    Range range_;
    std::vector<std::string_view> choices_;
    std::function<std::string()> table_text_;
    bool required_ = false, or_table_ = false, reloadable_ = false, printed_ = true;
};

/// A key whose value goes to `target`; the content of `target` before reading is the default.
[[nodiscard]] inline Key key(std::string_view name, Target target) {
    return {name, std::move(target)};
}
/// A key whose choices are the names of an enumeration (core/text/enum_names.hpp).
template<NamedEnum Enum>
[[nodiscard]] Key key(std::string_view name, Enum* target) {
    const auto set = [target](std::string_view word) {
        if (const auto value = enum_named<Enum>(word)) *target = *value;
    };
    const auto get = [target] { return std::string(name_of(*target)); };
    return Key(name, Word{set, get}).choices(names_of_enum<Enum>());
}

using Keys = std::vector<Key>;

/// Name of a table in messages: its file and its dotted path ("" for the root).
struct Where {
    std::filesystem::path file;
    std::string path;

    [[nodiscard]] Where in(std::string_view key) const {
        return {file, path.empty() ? std::string(key) : path + "." + std::string(key)};
    }
};

/// Throws ConfigError `file:line:column: path: what`; with `cause`, the errno of a file that is named there,
/// InputError, with which reading ends.
[[noreturn]] void fail(const Where& where, Position at, std::string_view what, int cause = 0);
/// fail() for a file that is named there and cannot be found: for `why`, or where permissions hide it for
/// `error`.
[[noreturn]] void fail_missing(const Where& where, Position at, const std::filesystem::path& path,
                               std::string_view why, const std::error_code& error);

/// Position of the value of each key that the file gives.
using Given = std::map<std::string, Position, std::less<>>;

/// A key whose choices are the names of an enumeration and the word `nothing`, for no value.
template<NamedEnum Enum>
[[nodiscard]] Key key(std::string_view name, std::optional<Enum>* target, std::string_view nothing) {
    const auto set = [target](std::string_view word) { *target = enum_named<Enum>(word); };
    const auto get = [target, nothing] { return std::string(*target ? name_of(**target) : nothing); };
    std::vector<std::string_view> words = names_of_enum<Enum>();
    words.insert(words.begin(), nothing);
    return Key(name, Word{set, get}).choices(std::move(words));
}
/// A boolean key written as one of two words.
[[nodiscard]] inline Key key(std::string_view name, bool* target, std::string_view when_true,
                             std::string_view when_false) {
    const auto set = [=](std::string_view word) { *target = word == when_true; };
    const auto get = [=] { return std::string(*target ? when_true : when_false); };
    return Key(name, Word{set, get}).choices({when_true, when_false});
}

/// Mistakes found in a file, collected to report all of them at once. Thread-bound.
class Mistakes {
public:
    void add(const Where& where, Position at, std::string_view what);
    /// Adds the lines of a ConfigError; a line that is already there is not repeated.
    void add(std::string text);
    /// Runs `read` and adds the ConfigError that it throws. Returns false if it threw one.
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
    /// Throws ConfigError with one line for each mistake, in the order in which they were found.
    void throw_if_any() const;

private:
    std::vector<std::string> lines_;
};

/// Reads the members of `table` into the targets of `keys`. A key that cannot be read leaves its target
/// unchanged. Members named in `elsewhere` (tables, or keys that the caller reads) are skipped; any other
/// unknown key is a mistake, with a suggestion, and so is a missing required key. With `annotated`, a value
/// may also be written as { value = ..., provenance = "...", source = "..." }.
Given read_keys(const Value& table, const Where& where, const Keys& keys, Mistakes& mistakes,
                const std::vector<std::string_view>& elsewhere = {}, bool annotated = false);

/// As above, for a table that is read by itself. Throws ConfigError with all mistakes.
Given read_keys(const Value& table, const Where& where, const Keys& keys,
                const std::vector<std::string_view>& elsewhere = {}, bool annotated = false);

/// Returns `value`, which must be a table. Throws ConfigError if it is not.
const Value& expect_table(const Value& value, const Where& where);

/// Elements of an array of tables [[name]]; `where` is the array's own. Throws ConfigError if it is not one.
const std::vector<Value>& expect_tables(const Member& member, const Where& where);

/// The first key whose bound value lies outside of its range, as `key: value, allowed ...` in the units of
/// the file; empty if all are within. For structs that a program filled.
[[nodiscard]] std::string explain_out_of_range(const Keys& keys);

/// The value of a key as TOML.
[[nodiscard]] std::string value_text(const Key& key);
/// Type of the key's value in the file: "integer", "number", "string", "array of 3 numbers [x, y, z]", ...
[[nodiscard]] std::string type_text(const Key& key);
/// Allowed values beside the type: "1 to 64 px", "timer | none", ...
[[nodiscard]] std::string allowed_text(const Key& key);
/// Lines of a table: for each printed key a comment with help and allowed values, and `key = value`.
[[nodiscard]] std::string print_keys(const Keys& keys);
/// `text` as a TOML basic string.
[[nodiscard]] std::string toml_string(std::string_view text);

} // namespace obscura::config
