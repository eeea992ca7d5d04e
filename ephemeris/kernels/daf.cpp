// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/daf.hpp"

#include "core/error.hpp"
#include "core/io/file_bytes.hpp"
#include "core/io/input_file.hpp"
#include "ephemeris/kernels/daf_layout.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <optional>
#include <string_view>

namespace obscura::ephemeris {
namespace {

constexpr std::size_t words_per_record = record_bytes / sizeof(double);
constexpr std::string_view transfer_start = "DAFETF NAIF DAF ENCODED TRANSFER FILE";
/// Largest number of doubles of a summary (DAF Required Reading).
constexpr std::int32_t max_doubles = 124;

static_assert(std::endian::native == std::endian::little, "byte orders are swapped for big-endian files");

template<typename T>
T read_as(const std::byte* at, bool swapped) {
    std::array<std::byte, sizeof(T)> bytes{};
    for (std::size_t i = 0; i < sizeof(T); ++i)
        bytes[i] = at[swapped ? sizeof(T) - 1 - i : i];
    return std::bit_cast<T>(bytes);
}

std::string printable_trimmed(std::string_view text) {
    while (!text.empty() && (text.back() == ' ' || text.back() == '\0'))
        text.remove_suffix(1);
    while (!text.empty() && text.front() == ' ')
        text.remove_prefix(1);
    std::string clean(text);
    for (char& c : clean)
        if (c < ' ' || c > '~') c = '?';
    return clean;
}

/// Byte order: named, or else seen from the number of doubles of a summary.
bool is_swapped(const std::string& file, const std::byte* data) {
    const std::string format =
        printable_trimmed(std::string_view(reinterpret_cast<const char*>(data) + 88, 8));
    if (format == "BIG-IEEE") return true;
    if (format.empty()) {
        const auto doubles = read_as<std::int32_t>(data + 8, false);
        return doubles < 1 || doubles > max_doubles;
    }
    if (format != "LTL-IEEE")
        throw InputError(fmt::format("{}: number format '{}', allowed LTL-IEEE, BIG-IEEE", file, format));
    return false;
}

/// Integers of a summary, with the two addresses.
std::int32_t integers_of(std::string_view kind) {
    return kind == "PCK" ? 5 : 6;
}

std::string place_of(const std::string& file, std::size_t number, const std::string& name) {
    return fmt::format("{}: segment {} ({})", file, number, name);
}

/// Kind of a kernel from its identification word, "DAF/SPK ".
std::string kind_of(const std::string& file, std::string_view id) {
    for (const std::string_view kind : {"SPK", "CK", "PCK"})
        if (printable_trimmed(id) == fmt::format("DAF/{}", kind)) return std::string(kind);
    if (id.starts_with("NAIF/DAF"))
        throw InputError(fmt::format(
            "{}: a DAF of before 1998 that does not name its kind; convert it with NAIF's tools", file));
    throw InputError(fmt::format("{}: identification '{}' where DAF/SPK, DAF/CK or DAF/PCK is expected", file,
                                 printable_trimmed(id)));
}

/// Lines of a transfer file; quotes are removed from values.
class TransferLines {
public:
    explicit TransferLines(const std::string& file) : file_(file), in_(file) {
        if (!in_) throw InputError(fmt::format("{}: cannot be opened", file), errno);
    }

    [[nodiscard]] std::string next() {
        std::string line;
        do {
            if (!std::getline(in_, line)) fail("the file ends early");
            ++number_;
            while (!line.empty() && (line.back() == '\r' || line.back() == ' '))
                line.pop_back();
        } while (line.empty());
        return line;
    }

    [[nodiscard]] std::string text() {
        std::string line = next();
        if (line.size() < 2 || line.front() != '\'' || line.back() != '\'')
            fail("a value in quotes is expected");
        return line.substr(1, line.size() - 2);
    }

    /// Integer in hexadecimal, in quotes.
    [[nodiscard]] std::int32_t integer() {
        const std::string value = text();
        std::int32_t number = 0;
        const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number, 16);
        if (error != std::errc() || end != value.data() + value.size())
            fail(fmt::format("'{}' is not a hexadecimal integer", printable_trimmed(value)));
        return number;
    }

    /// Double in quotes: mantissa and exponent in hexadecimal, 'D7789BEA059AE^7' is 0.D7789BEA059AE 16^7.
    [[nodiscard]] double number() {
        const std::string value = text();
        const std::size_t caret = value.find('^');
        const bool negative = value.starts_with('-');
        const char* const first = value.data() + (negative ? 1 : 0);
        const char* const last =
            caret == std::string::npos ? value.data() + value.size() : value.data() + caret;
        std::uint64_t mantissa = 0;
        std::int32_t exponent = 0;
        bool good = last - first <= 14;
        if (good) {
            const auto [end, error] = std::from_chars(first, last, mantissa, 16);
            good = error == std::errc() && end == last;
        }
        if (good && caret != std::string::npos) {
            const char* const stop = value.data() + value.size();
            const auto [end, error] = std::from_chars(last + 1, stop, exponent, 16);
            good = error == std::errc() && end == stop && std::abs(exponent) < 256;
        } else if (good) {
            good = mantissa == 0;
        }
        if (!good) fail(fmt::format("'{}' is not a hexadecimal number", printable_trimmed(value)));
        const auto digits = static_cast<int>(last - first);
        const double size = std::ldexp(static_cast<double>(mantissa), 4 * (exponent - digits));
        return negative ? -size : size;
    }

    /// A count in decimal after `keyword` (which may be empty): "BEGIN_ARRAY 1 39" has two.
    [[nodiscard]] std::size_t count(std::string_view line) const {
        std::size_t n = 0;
        const std::size_t at = line.rfind(' ') == std::string_view::npos ? 0 : line.rfind(' ') + 1;
        const auto [end, error] = std::from_chars(line.data() + at, line.data() + line.size(), n);
        if (error != std::errc() || end != line.data() + line.size())
            fail(fmt::format("'{}' where a count is expected", printable_trimmed(line)));
        return n;
    }

    [[noreturn]] void fail(const std::string& why) const {
        throw InputError(fmt::format("{}:{}: {}", file_, number_, why));
    }

private:
    const std::string& file_;
    std::ifstream in_;
    std::size_t number_ = 0;
};

} // namespace

bool Daf::starts_as_daf(const std::filesystem::path& file) {
    std::array<char, 8> start{};
    std::ifstream in(file, std::ios::binary);
    if (!in.read(start.data(), start.size())) return false;
    const std::string_view id(start.data(), start.size());
    return id.starts_with("DAF/") || id.starts_with("NAIF/DAF") || id.starts_with("DAFETF ");
}

Daf::Daf(const std::filesystem::path& file) : file_(file.string()) {
    const InputFile in = open_input(file);
    std::array<char, transfer_start.size()> start{};
    const std::size_t got = std::fread(start.data(), 1, start.size(), in.get());
    if (got == start.size() && std::string_view(start.data(), got) == transfer_start) {
        read_transfer();
        return;
    }
    FileBytes read = read_file_bytes(file_);
    if (read.size < record_bytes)
        throw InputError(
            fmt::format("{}: {} bytes, a DAF kernel has at least {}", file_, read.size, record_bytes));
    read_binary(std::move(read.bytes), read.size);
}

void Daf::read_binary(std::shared_ptr<const std::byte[]> bytes, std::size_t size) {
    const std::byte* const data = bytes.get();
    const auto text = [&](std::size_t at, std::size_t length) {
        return std::string_view(reinterpret_cast<const char*>(data) + at, length);
    };
    kind_ = kind_of(file_, text(0, 8));

    const bool swapped = is_swapped(file_, data);
    if (text(ftp_offset, 6) == ftp_string.substr(0, 6) && text(ftp_offset, ftp_string.size()) != ftp_string)
        throw InputError(fmt::format(
            "{}: damaged by a transfer in text mode (FTP string changed); copy it in binary mode", file_));

    const std::int32_t nd = read_as<std::int32_t>(data + 8, swapped);
    const std::int32_t ni = read_as<std::int32_t>(data + 12, swapped);
    if (nd != 2 || ni != integers_of(kind_))
        throw InputError(fmt::format("{}: summaries of {} doubles and {} integers, a {} kernel has 2 and {}",
                                     file_, nd, ni, kind_, integers_of(kind_)));
    const std::size_t summary_words = static_cast<std::size_t>(nd) + (static_cast<std::size_t>(ni) + 1) / 2;

    // Data in native byte order.
    const std::size_t words = size / sizeof(double);
    const double* values = reinterpret_cast<const double*>(data);
    if (swapped) {
        const auto loaded = std::make_shared<std::vector<double>>(words);
        for (std::size_t i = 0; i < words; ++i)
            (*loaded)[i] = read_as<double>(data + i * sizeof(double), true);
        values = loaded->data();
        storage_ = loaded;
    } else {
        storage_ = bytes;
    }

    // Walk the doubly linked summary records; record numbers and addresses count from 1.
    const std::size_t records = size / record_bytes;
    const auto record_number = [&](double number, const char* what) -> std::size_t {
        if (!(number >= 0 && number <= static_cast<double>(records)) || number != std::floor(number))
            throw InputError(fmt::format("{}: {} is record {}, the file has {} (truncated?)", file_, what,
                                         number, records));
        return static_cast<std::size_t>(number);
    };
    std::size_t record = record_number(read_as<std::int32_t>(data + 76, swapped), "first summary record");
    for (std::size_t visited = 0; record != 0; ++visited) {
        if (visited >= records) throw InputError(fmt::format("{}: summary records form a circle", file_));
        if (record + 1 > records)
            throw InputError(fmt::format("{}: name record {} is missing, the file has {} (truncated?)", file_,
                                         record + 1, records));
        const std::size_t start = (record - 1) * words_per_record;
        const double count = values[start + 2];
        const auto most = static_cast<double>((words_per_record - 3) / summary_words);
        if (!(count >= 0 && count <= most) || count != std::floor(count))
            throw InputError(
                fmt::format("{}: record {}: {} summaries, allowed 0 to {}", file_, record, count, most));
        for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
            const std::size_t at = start + 3 + i * summary_words;
            Array& array = arrays_.emplace_back();
            array.name = printable_trimmed(text(record * record_bytes + i * summary_words * sizeof(double),
                                                summary_words * sizeof(double)));
            array.place = place_of(file_, arrays_.size(), array.name);
            array.doubles = {values[at], values[at + 1]};
            const std::byte* const integers = data + (at + 2) * sizeof(double);
            for (std::int32_t k = 0; k < ni; ++k)
                array.integers.push_back(
                    read_as<std::int32_t>(integers + 4 * static_cast<std::size_t>(k), swapped));
            const std::int64_t end = array.integers.back();
            array.integers.pop_back();
            const std::int64_t begin = array.integers.back();
            array.integers.pop_back();
            if (begin < 1 || end < begin || static_cast<std::size_t>(end) > words)
                throw InputError(fmt::format("{}: data at words {} to {}, the file has {} (truncated?)",
                                             array.place, begin, end, words));
            array.words = {values + begin - 1, static_cast<std::size_t>(end - begin + 1)};
        }
        record = record_number(values[start], "next summary record");
    }
}

void Daf::read_transfer() {
    TransferLines lines(file_);
    (void)lines.next();
    kind_ = kind_of(file_, lines.text());
    const std::int32_t nd = lines.integer();
    const std::int32_t ni = lines.integer();
    if (nd != 2 || ni != integers_of(kind_))
        lines.fail(fmt::format("summaries of {} doubles and {} integers, a {} kernel has 2 and {}", nd, ni,
                               kind_, integers_of(kind_)));
    (void)lines.text(); // internal file name

    const auto data = std::make_shared<std::vector<std::vector<double>>>();
    for (std::string line = lines.next(); line.starts_with("BEGIN_ARRAY "); line = lines.next()) {
        Array& array = arrays_.emplace_back();
        const std::size_t size = lines.count(line);
        array.name = printable_trimmed(lines.text());
        array.place = place_of(file_, arrays_.size(), array.name);
        for (std::int32_t i = 0; i < nd; ++i)
            array.doubles.push_back(lines.number());
        for (std::int32_t i = 0; i < ni - 2; ++i)
            array.integers.push_back(lines.integer());
        std::vector<double>& words = data->emplace_back();
        while (words.size() < size) {
            const std::size_t block = lines.count(lines.next());
            if (block == 0 || block > size - words.size())
                lines.fail(
                    fmt::format("block of {} values, {} remain in the array", block, size - words.size()));
            for (std::size_t i = 0; i < block; ++i)
                words.push_back(lines.number());
        }
        if (size == 0) lines.fail("array without values");
        if (!lines.next().starts_with("END_ARRAY ")) lines.fail("END_ARRAY is expected");
    }
    for (std::size_t i = 0; i < arrays_.size(); ++i)
        arrays_[i].words = (*data)[i];
    storage_ = data;
}

} // namespace obscura::ephemeris
