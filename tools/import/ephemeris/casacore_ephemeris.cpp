// SPDX-License-Identifier: Apache-2.0
#include "tools/import/ephemeris/casacore_ephemeris.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/path_state.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <map>
#include <string_view>

namespace obscura::tools {
namespace {

constexpr std::size_t max_table_bytes = 256U << 20;
constexpr double day_s = 86400;
constexpr double mjd_j2000 = 51544.5;

/// Coefficients of a body in a row of 32 days, from `first` on: `sets` intervals of x, y, z with `terms`
/// each.
struct Series {
    std::int32_t target, center;
    std::size_t first, terms, sets;
};
/// Layout of DE405 (JPL IOM 312.F-98-048; also the third column keyword of the table): pointers less 3.
constexpr std::array series{Series{1, 0, 0, 14, 4},   Series{2, 0, 168, 10, 2}, Series{3, 0, 228, 13, 2},
                            Series{4, 0, 306, 11, 1}, Series{5, 0, 339, 8, 1},  Series{6, 0, 363, 7, 1},
                            Series{7, 0, 384, 6, 1},  Series{8, 0, 402, 6, 1},  Series{9, 0, 420, 6, 1},
                            Series{10, 0, 750, 11, 2}};
/// The Moon relative to Earth.
constexpr Series moon{301, 399, 438, 13, 8};
constexpr std::size_t row_values = 1018;

std::string read_table_file(const std::filesystem::path& file) {
    const InputFile in = open_input(file);
    const std::uintmax_t size = file_bytes_at(file);
    if (size > max_table_bytes)
        throw InputError(fmt::format("{}: {} bytes, a table of DE405 has at most {}", file.string(), size,
                                     max_table_bytes));
    std::string bytes(static_cast<std::size_t>(size), '\0');
    bytes.resize(std::fread(bytes.data(), 1, bytes.size(), in.get()));
    return bytes;
}

/// Keywords of a table in casacore's AipsIO form: big-endian, texts with their length before them.
class Keywords {
public:
    Keywords(const std::string& bytes, const std::string& file) : bytes_(bytes), file_(file) {
        // The first record is that of the table; its fields are described before their values.
        constexpr std::string_view start{"\0\0\0\013TableRecord", 15};
        at_ = bytes.find(start);
        if (!bytes.starts_with("\xbe\xbe\xbe\xbe") || at_ == std::string::npos)
            throw InputError(fmt::format("{}: not the description of a casacore table", file));
        at_ += start.size();
        (void)integer(); // version
        (void)integer(); // length
        if (text() != "RecordDesc") damaged("a description of keywords");
        (void)integer(); // version
        const std::uint32_t count = integer();
        constexpr std::uint32_t max_keywords = 10'000;
        if (count > max_keywords) damaged("a count of keywords");
        std::vector<std::pair<std::string, std::uint32_t>> fields;
        for (std::uint32_t i = 0; i < count; ++i) {
            std::string name = text();
            const std::uint32_t type = integer();
            (void)text(); // comment
            fields.emplace_back(std::move(name), type);
        }
        (void)integer(); // kind of record
        constexpr std::uint32_t type_double = 8, type_string = 11;
        for (const auto& [name, type] : fields) {
            if (type == type_double)
                numbers_[name] = number();
            else if (type == type_string)
                texts_[name] = text();
            else
                throw InputError(fmt::format("{}: keyword {} of type {}, expected a double or a string", file,
                                             name, type));
        }
    }

    [[nodiscard]] double number(const char* name) const {
        const auto found = numbers_.find(name);
        if (found == numbers_.end() || !std::isfinite(found->second))
            throw InputError(
                fmt::format("{}: no number {}: not a table of a planetary ephemeris", file_, name));
        return found->second;
    }
    [[nodiscard]] std::string text(const char* name) const {
        const auto found = texts_.find(name);
        return found == texts_.end() ? "" : found->second;
    }

private:
    [[noreturn]] void damaged(const char* what) const {
        throw InputError(fmt::format("{}: byte {}: {} is expected", file_, at_, what));
    }
    template<typename T>
    T take() {
        if (bytes_.size() - at_ < sizeof(T)) damaged("a keyword, but the file ends here: it");
        std::array<char, sizeof(T)> raw{};
        for (std::size_t i = 0; i < sizeof(T); ++i)
            raw[sizeof(T) - 1 - i] = bytes_[at_ + i];
        at_ += sizeof(T);
        return std::bit_cast<T>(raw);
    }
    std::uint32_t integer() { return take<std::uint32_t>(); }
    double number() { return take<double>(); }
    std::string text() {
        const std::uint32_t size = integer();
        if (size > bytes_.size() - at_) damaged("a text");
        at_ += size;
        return bytes_.substr(at_ - size, size);
    }

    const std::string& bytes_;
    const std::string& file_;
    std::size_t at_ = 0;
    std::map<std::string, double> numbers_;
    std::map<std::string, std::string> texts_;
};

/// Rows of the table: arrays of doubles one after another in the file of its storage manager.
class Rows {
public:
    explicit Rows(const std::string& file) : bytes_(read_table_file(file)) {
        constexpr std::size_t header = 16;
        if (bytes_.size() < header + row_bytes || (bytes_.size() - header + 4) % row_bytes != 0)
            throw InputError(fmt::format("{}: {} bytes, expected {} and {} for each row but 4", file,
                                         bytes_.size(), header, row_bytes));
        count_ = (bytes_.size() - header + 4) / row_bytes;
        for (std::size_t row = 0; row < count_; ++row) {
            // References, dimensions, length.
            std::array<std::uint32_t, 3> shape{};
            std::memcpy(shape.data(), bytes_.data() + header + row * row_bytes, sizeof(shape));
            if (shape[1] != 1 || shape[2] != row_values)
                throw InputError(fmt::format("{}: row {}: {} dimensions, {} values, expected 1 and {}", file,
                                             row + 1, shape[1], shape[2], row_values));
            std::array<double, row_values>& values = rows_.emplace_back();
            std::memcpy(values.data(), bytes_.data() + header + row * row_bytes + sizeof(shape),
                        sizeof(values));
            for (const double v : values)
                if (!std::isfinite(v))
                    throw InputError(fmt::format("{}: row {}: a value that is no number", file, row + 1));
        }
    }
    [[nodiscard]] const std::vector<std::array<double, row_values>>& all() const { return rows_; }

private:
    static constexpr std::size_t row_bytes = 12 + row_values * sizeof(double) + 4;
    std::string bytes_;
    std::size_t count_ = 0;
    std::vector<std::array<double, row_values>> rows_;
};

/// An SPK segment of type 2 from the rows, with coefficients times `factor`. Rows begin at `first_s`, TDB s
/// since J2000, and cover `row_s` each.
ephemeris::DafArrayData segment(const Series& s, const std::vector<std::array<double, row_values>>& rows,
                                double first_s, double row_s, double factor) {
    const double interval_s = row_s / static_cast<double>(s.sets);
    const std::size_t record = 2 + 3 * s.terms;
    std::vector<double> words;
    for (std::size_t row = 0; row < rows.size(); ++row)
        for (std::size_t set = 0; set < s.sets; ++set) {
            const double begin_s = first_s + static_cast<double>(row * s.sets + set) * interval_s;
            words.insert(words.end(), {begin_s + interval_s / 2, interval_s / 2});
            for (std::size_t i = 0; i < 3 * s.terms; ++i)
                words.push_back(rows[row][s.first + set * 3 * s.terms + i] * factor);
        }
    words.insert(words.end(), {first_s, interval_s, static_cast<double>(record),
                               static_cast<double>(rows.size() * s.sets)});
    return {"DE-0405LE-0405",
            {first_s, first_s + row_s * static_cast<double>(rows.size())},
            {s.target, s.center, 1, 2},
            std::move(words)};
}

} // namespace

CasacoreEphemeris read_casacore_ephemeris(const std::filesystem::path& folder) {
    const std::string description = (folder / "table.dat").string();
    if (!path_exists(description))
        throw InputError(fmt::format(
            "{}: no casacore table (table.dat); Debian's package casacore-data-jpl-de405 installs {}",
            folder.string(), casacore_de405));
    const std::string bytes = read_table_file(description);
    const Keywords keywords(bytes, description);
    constexpr double number = 405;
    if (keywords.number("DENUM") != number)
        throw InputError(
            fmt::format("{}: ephemeris DE{}, allowed DE405", description, keywords.number("DENUM")));
    const double row_days = keywords.number("dMJD");
    if (row_days != 32) throw InputError(fmt::format("{}: dMJD is {}, expected 32", description, row_days));
    const double ratio = keywords.number("EMRAT");
    if (!(ratio > 0)) throw InputError(fmt::format("{}: EMRAT is {}, expected above 0", description, ratio));
    const Rows rows((folder / "table.f0i").string());
    // The key of a row, its first day, is MJD0 and a whole number of intervals, from 1.
    const double first_s = (keywords.number("MJD0") + row_days - mjd_j2000) * day_s;
    const double row_s = row_days * day_s;

    CasacoreEphemeris out{keywords.text("VS_TYPE"), {}};
    for (const Series& s : series)
        out.segments.push_back(segment(s, rows.all(), first_s, row_s, 1));
    out.segments.push_back(segment({301, 3, moon.first, moon.terms, moon.sets}, rows.all(), first_s, row_s,
                                   ratio / (1 + ratio)));
    out.segments.push_back(
        segment({399, 3, moon.first, moon.terms, moon.sets}, rows.all(), first_s, row_s, -1 / (1 + ratio)));
    // Planets without moons are at their barycentres: one record of two terms for all times.
    const double end_s = first_s + row_s * static_cast<double>(rows.all().size());
    const double middle_s = (first_s + end_s) / 2, half_s = (end_s - first_s) / 2;
    for (const std::int32_t planet : {199, 299})
        out.segments.push_back({"DE-0405LE-0405",
                                {first_s, end_s},
                                {planet, planet / 100, 1, 2},
                                {middle_s, half_s, 0, 0, 0, 0, 0, 0, first_s, 2 * half_s, 8, 1}});
    return out;
}

} // namespace obscura::tools
