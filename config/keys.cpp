// SPDX-License-Identifier: Apache-2.0
#include "config/keys.hpp"

#include "config/key_texts.hpp"
#include "core/error.hpp"
#include "core/overloaded.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace obscura::config {
namespace {

/// Reads one value into one target.
class Reader {
public:
    Reader(const Key& key, const Value& value, const Where& where)
        : key_(key), value_(value), where_(where) {}

    void operator()(bool* target) const {
        if (value_.kind != Value::Kind::boolean) wrong_type();
        *target = value_.boolean;
    }
    template<typename Integer>
    void operator()(Integer* target) const {
        if (value_.kind != Value::Kind::integer) wrong_type();
        // Range limits are whole and far below 2^53; only the default limits need the target's own.
        const bool fits =
            std::is_unsigned_v<Integer>
                ? value_.integer >= 0 &&
                      (sizeof(Integer) == 8 || value_.integer <= std::numeric_limits<std::uint32_t>::max())
                : sizeof(Integer) == 8 || (value_.integer >= std::numeric_limits<std::int32_t>::min() &&
                                           value_.integer <= std::numeric_limits<std::int32_t>::max());
        const auto real = static_cast<double>(value_.integer);
        if (real < key_.range().min || real > key_.range().max)
            out_of_range(fmt::format("{}", value_.integer), range_text(key_.range(), key_.unit()));
        if (!fits)
            out_of_range(fmt::format("{}", value_.integer),
                         fmt::format("{} to {}", std::numeric_limits<Integer>::min(),
                                     std::numeric_limits<Integer>::max()));
        *target = static_cast<Integer>(value_.integer);
    }
    void operator()(double* target) const { *target = number(value_); }
    void operator()(Scaled target) const { *target.value = number(value_) * target.si; }
    void operator()(std::string* target) const {
        const std::string& text = word();
        if (text.size() > 1000) fail(where_, value_.at, "longer than 1000 characters");
        if (text.find('\0') != std::string::npos) fail(where_, value_.at, "holds a zero character");
        *target = text;
    }
    void operator()(const Word& target) const { target.set(word()); }
    void operator()(Files target) const {
        const bool one = value_.kind == Value::Kind::string;
        if (!one && value_.kind != Value::Kind::array) wrong_type();
        std::vector<std::string> files;
        const auto add = [&](const Value& value) {
            std::string file;
            Reader(key_, value, where_)(Path{&file, true, one});
            if (!file.empty()) files.push_back(std::move(file));
        };
        if (one) {
            add(value_);
        } else {
            for (const Value& item : value_.items)
                add(item);
        }
        *target.files = std::move(files);
    }
    void operator()(const Path& target) const {
        const std::string& text = word();
        if (text.empty() && target.optional) {
            target.value->clear();
            return;
        }
        if (text.empty()) fail(where_, value_.at, "empty, a file name is wanted");
        if (text.find('\0') != std::string::npos) fail(where_, value_.at, "holds a zero character");
        const std::filesystem::path path = (where_.file.parent_path() / text).lexically_normal();
        if (target.must_exist) {
            std::error_code error;
            const auto status = std::filesystem::status(path, error);
            if (!std::filesystem::exists(status))
                fail_missing(where_, value_.at, path, "no such file", error);
            if (!std::filesystem::is_regular_file(status))
                fail(where_, value_.at, fmt::format("{}: not a regular file", path.string()));
        }
        *target.value = path.string();
    }
    void operator()(Vec3* target) const {
        const auto c = components(3);
        *target = {c[0], c[1], c[2]};
    }
    void operator()(Quat* target) const {
        const auto c = components(4);
        const Quat q{c[0], c[1], c[2], c[3]};
        if (!(std::abs(norm(q) - 1) <= 1e-3))
            fail(where_, value_.at,
                 fmt::format("|q| = {:.6g}, a unit quaternion [w, x, y, z] is wanted", norm(q)));
        *target = normalized(q);
    }
    void operator()(Numbers target) const {
        const auto c = components(target.count);
        std::copy(c.begin(), c.end(), target.first);
    }
    void operator()(std::vector<double>* target) const {
        if (value_.kind != Value::Kind::array) wrong_type();
        std::vector<double> numbers;
        for (const Value& item : value_.items)
            numbers.push_back(number(item));
        *target = std::move(numbers);
    }
    void operator()(Faces target) const {
        if (value_.kind != Value::Kind::array) wrong_type();
        std::vector<std::vector<Vec3>> faces;
        for (const Value& face : value_.items) {
            if (face.kind != Value::Kind::array || face.items.size() < 3)
                fail(where_, face.at, "a face is an array of 3 or more corners [x, y, z]");
            std::vector<Vec3> corners;
            for (const Value& corner : face.items) {
                if (corner.kind != Value::Kind::array || corner.items.size() != 3)
                    fail(where_, corner.at, "a corner is an array of 3 numbers [x, y, z]");
                corners.push_back(
                    {number(corner.items[0]), number(corner.items[1]), number(corner.items[2])});
            }
            faces.push_back(std::move(corners));
        }
        if (faces.empty()) fail(where_, value_.at, "empty, at least one face is wanted");
        *target.faces = std::move(faces);
    }
    void operator()(Curve target) const {
        if (value_.kind != Value::Kind::array) wrong_type();
        std::vector<SpectralPoint> points;
        for (const Value& pair : value_.items) {
            if (pair.kind != Value::Kind::array || pair.items.size() != 2)
                fail(where_, pair.at, "each entry must be a [wavelength_nm, value] pair");
            const double nm = plain_number(pair.items[0]);
            if (!(nm >= 1 && nm <= 1e6))
                fail(where_, pair.items[0].at,
                     fmt::format("wavelength {} is out of range, allowed 1 to 1e6 nm", nm));
            if (!points.empty() && nm * 1e-9 <= points.back().wavelength_m)
                fail(where_, pair.at, "wavelengths must increase");
            points.push_back({nm * 1e-9, number(pair.items[1])});
        }
        if (points.empty())
            fail(where_, value_.at, "empty, at least one [wavelength_nm, value] pair is wanted");
        *target.points = std::move(points);
    }

private:
    [[noreturn]] void wrong_type() const {
        std::string allowed;
        if (const std::string range = range_text(key_.range(), key_.unit());
            !range.empty() && !std::holds_alternative<Curve>(key_.target))
            allowed = fmt::format(", {}", range);
        if (!key_.choices().empty()) allowed = fmt::format(": {}", fmt::join(key_.choices(), ", "));
        fail(where_, value_.at,
             fmt::format("is {}, allowed {}{}", kind_name(value_.kind), type_name(key_.target), allowed));
    }
    [[noreturn]] void out_of_range(const std::string& value, const std::string& allowed) const {
        fail(where_, value_.at, fmt::format("{} is out of range, allowed {}", value, allowed));
    }
    [[nodiscard]] const std::string& word() const {
        if (value_.kind != Value::Kind::string) wrong_type();
        if (!key_.choices().empty() &&
            std::find(key_.choices().begin(), key_.choices().end(), value_.string) == key_.choices().end())
            fail(where_, value_.at,
                 fmt::format("\"{}\" is not known, {}", printable(value_.string, 60),
                             allowed_words(value_.string, {key_.choices().begin(), key_.choices().end()})));
        return value_.string;
    }
    [[nodiscard]] double plain_number(const Value& value) const {
        double number = 0;
        if (value.kind == Value::Kind::integer)
            number = static_cast<double>(value.integer);
        else if (value.kind == Value::Kind::real)
            number = value.real;
        else if (&value == &value_)
            wrong_type();
        else
            fail(where_, value.at,
                 fmt::format("holds {}, allowed {}", kind_name(value.kind), type_name(key_.target)));
        if (!std::isfinite(number)) fail(where_, value.at, fmt::format("{} is not a finite number", number));
        return number;
    }
    [[nodiscard]] double number(const Value& value) const {
        const double number = plain_number(value);
        if (number < key_.range().min || number > key_.range().max)
            fail(
                where_, value.at,
                fmt::format("{} is out of range, allowed {}", number, range_text(key_.range(), key_.unit())));
        return number;
    }
    [[nodiscard]] std::vector<double> components(std::size_t count) const {
        if (value_.kind != Value::Kind::array) wrong_type();
        if (value_.items.size() != count)
            fail(where_, value_.at,
                 fmt::format("has {} elements, allowed {}", value_.items.size(), type_name(key_.target)));
        std::vector<double> numbers;
        for (const Value& item : value_.items)
            numbers.push_back(number(item));
        return numbers;
    }

    const Key& key_;
    const Value& value_;
    const Where& where_;
};

constexpr std::array<std::string_view, 3> provenance_keys{"value", "provenance", "source"};

/// Whether a table is a value with its provenance, and not a table of its own that may have such keys, too.
bool has_provenance(const Value& table) {
    return table.find("value") != nullptr &&
           std::all_of(table.members.begin(), table.members.end(), [](const Member& member) {
               return std::find(provenance_keys.begin(), provenance_keys.end(), member.key) !=
                      provenance_keys.end();
           });
}

/// The value inside { value = ..., provenance = "...", source = "..." }, or `value` itself.
const Value& unwrapped(const Value& value, const Where& where) {
    if (value.kind != Value::Kind::table) return value;
    for (const Member& member : value.members) {
        if (member.key == "value") continue;
        if (member.key != "provenance" && member.key != "source")
            fail(where.in(member.key), member.at,
                 "unknown key, " + suggestion(member.key, {provenance_keys.begin(), provenance_keys.end()}));
        if (member.value.kind != Value::Kind::string)
            fail(where.in(member.key), member.value.at,
                 fmt::format("is {}, allowed a string", kind_name(member.value.kind)));
    }
    const Member* inner = value.find("value");
    if (inner == nullptr) fail(where, value.at, "the table has no key \"value\"");
    return inner->value;
}

} // namespace

void fail(const Where& where, Position at, std::string_view what, int cause) {
    std::string line = where.file.string();
    if (at.line != 0) line += fmt::format(":{}:{}", at.line, at.column);
    if (!where.path.empty()) line += ": " + printable(where.path, 200);
    line = fmt::format("{}: {}", line, what);
    if (cause != 0) throw InputError(line, cause);
    throw ConfigError(line);
}

void fail_missing(const Where& where, Position at, const std::filesystem::path& path, std::string_view why,
                  const std::error_code& error) {
    if (status_of_input(error.value()) != exit_no_permission)
        fail(where, at, fmt::format("{}: {}", path.string(), why));
    fail(where, at, fmt::format("{}: cannot be opened: {}", path.string(), error.message()), error.value());
}

void Mistakes::add(const Where& where, Position at, std::string_view what) {
    collect([&] { fail(where, at, what); });
}

void Mistakes::add(std::string text) {
    // A ConfigError of a file that was read with mistakes of its own has several lines.
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        std::string line = text.substr(begin, end - begin);
        if (std::find(lines_.begin(), lines_.end(), line) == lines_.end()) lines_.push_back(std::move(line));
        begin = end + 1;
    }
}

void Mistakes::throw_if_any() const {
    if (!lines_.empty()) throw ConfigError(fmt::format("{}", fmt::join(lines_, "\n")));
}

Given read_keys(const Value& table, const Where& where, const Keys& keys, Mistakes& mistakes,
                const std::vector<std::string_view>& elsewhere, bool annotated) {
    Given given;
    for (const Member& member : table.members) {
        const Where here = where.in(member.key);
        const auto key =
            std::find_if(keys.begin(), keys.end(), [&](const Key& k) { return k.name == member.key; });
        if (key != keys.end()) {
            mistakes.collect([&] {
                const bool own = key->allows_table() && member.value.kind == Value::Kind::table &&
                                 !has_provenance(member.value);
                const Value& value = annotated && !own ? unwrapped(member.value, here) : member.value;
                if (!(key->allows_table() && value.kind == Value::Kind::table))
                    std::visit(Reader(*key, value, here), key->target);
            });
            given.emplace(member.key, member.value.at);
        } else if (std::find(elsewhere.begin(), elsewhere.end(), member.key) == elsewhere.end()) {
            std::vector<std::string_view> known = elsewhere;
            for (const Key& k : keys)
                known.push_back(k.name);
            mistakes.add(here, member.at, "unknown key, " + suggestion(member.key, known));
        }
    }
    for (const Key& key : keys)
        if (key.is_required() && given.find(key.name) == given.end())
            mistakes.add(where, table.at, fmt::format("the key \"{}\" is missing", key.name));
    return given;
}

Given read_keys(const Value& table, const Where& where, const Keys& keys,
                const std::vector<std::string_view>& elsewhere, bool annotated) {
    Mistakes mistakes;
    Given given = read_keys(table, where, keys, mistakes, elsewhere, annotated);
    mistakes.throw_if_any();
    return given;
}

const Value& expect_table(const Value& value, const Where& where) {
    if (value.kind != Value::Kind::table)
        fail(where, value.at, fmt::format("is {}, allowed a table", kind_name(value.kind)));
    return value;
}

const std::vector<Value>& expect_tables(const Member& member, const Where& where) {
    const bool good = member.value.kind == Value::Kind::array &&
                      std::all_of(member.value.items.begin(), member.value.items.end(),
                                  [](const Value& v) { return v.kind == Value::Kind::table; });
    if (!good) fail(where, member.at, fmt::format("allowed tables [[{}]]", where.path));
    return member.value.items;
}

namespace {

/// The numbers that a key is bound to, in the file's unit.
std::vector<double> bound_numbers(const Target& target) {
    return std::visit(Overloaded{
                          [](Scaled v) { return std::vector<double>{*v.value / v.si}; },
                          [](Vec3* v) {
                              return std::vector<double>{v->x, v->y, v->z};
                          },
                          [](Quat* v) {
                              return std::vector<double>{v->w, v->x, v->y, v->z};
                          },
                          [](Numbers v) { return std::vector<double>(v.first, v.first + v.count); },
                          [](std::vector<double>* v) { return *v; },
                          [](Faces v) {
                              std::vector<double> all;
                              for (const std::vector<Vec3>& face : *v.faces)
                                  for (const Vec3 corner : face)
                                      all.insert(all.end(), {corner.x, corner.y, corner.z});
                              return all;
                          },
                          [](Curve v) {
                              std::vector<double> all;
                              for (const SpectralPoint& p : *v.points)
                                  all.push_back(p.value);
                              return all;
                          },
                          []<typename Number>(Number* v) {
                              if constexpr (std::is_arithmetic_v<Number> && !std::is_same_v<Number, bool>)
                                  return std::vector<double>{static_cast<double>(*v)};
                              else
                                  return std::vector<double>{};
                          },
                          [](const auto&) { return std::vector<double>{}; },
                      },
                      target);
}

} // namespace

std::string explain_out_of_range(const Keys& keys) {
    for (const Key& key : keys)
        for (const double value : bound_numbers(key.target)) {
            // A limit in the file's unit may not survive the way to SI units and back to the last digit.
            const double slack = std::holds_alternative<Scaled>(key.target) ? 1e-12 * std::abs(value) : 0;
            const bool within = value >= key.range().min - slack && value <= key.range().max + slack;
            if (!within) // so that NaN is not
                return fmt::format("{}: {}, allowed {}", key.name, value,
                                   range_text(key.range(), key.unit()));
        }
    return {};
}

} // namespace obscura::config
