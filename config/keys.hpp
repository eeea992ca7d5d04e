// The table of keys: one line per key, from which reading, range checks, printing and documentation come.
#pragma once

#include "config/document.hpp"
#include "core/geometry.hpp"
#include "core/spectral_band.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <string_view>
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

/// One key of a table.
struct Key {
    std::string_view name;
    Target target;
    std::string_view unit = {}; ///< empty: none
    Range range = {};           ///< in the file's unit; of each component
    std::vector<std::string_view> choices = {};
    std::string_view help = {};
};
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

/// Reads the members of `table` into the targets of `keys`. Keys of `elsewhere` (tables, or keys the caller
/// reads itself) are passed over; any other key is refused with a suggestion. With `annotated`, a value may
/// also stand as { value = ..., provenance = "...", source = "..." }. Throws ConfigError.
Given read_keys(const Value& table, const Where& where, const Keys& keys,
                const std::vector<std::string_view>& elsewhere = {}, bool annotated = false);

/// The member tables of a table: `value` must be a table.
const Value& expect_table(const Value& value, const Where& where);

/// The tables of an array of tables [[name]]; `where` is the array's own.
const std::vector<Value>& expect_tables(const Member& member, const Where& where);

/// The value of a key as TOML.
[[nodiscard]] std::string value_text(const Key& key);
/// "integer, 1 to 64, px", "timer | none", ...
[[nodiscard]] std::string allowed_text(const Key& key);
/// `key = value  # help` lines of a table, wrapped for reading.
[[nodiscard]] std::string print_keys(const Keys& keys);
/// `text` as a TOML basic string.
[[nodiscard]] std::string toml_string(std::string_view text);

} // namespace obscura::config
