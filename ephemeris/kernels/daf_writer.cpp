// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/daf_writer.hpp"

#include "core/error.hpp"
#include "ephemeris/kernels/daf_layout.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace obscura::ephemeris {
namespace {

constexpr std::size_t record_words = record_bytes / sizeof(double);
constexpr std::size_t comment_bytes = 1000; ///< of a record of the comment area

static_assert(std::endian::native == std::endian::little, "values are copied as they are in memory");

template<typename T>
void put(std::string& bytes, std::size_t at, T value) {
    std::memcpy(bytes.data() + at, &value, sizeof(value));
}

/// Text of `size` bytes, cut or filled with blanks.
std::string padded(std::string_view text, std::size_t size) {
    std::string out(text.substr(0, size));
    out.resize(size, ' ');
    return out;
}

/// Records of the comment area: lines end with a zero byte, the text with byte 4 (DAF Required Reading).
std::string comment_records(std::string_view comments) {
    if (comments.empty()) return {};
    std::string text(comments);
    std::replace(text.begin(), text.end(), '\n', '\0');
    if (text.back() != '\0') text += '\0';
    text += '\x04';
    std::string records;
    for (std::size_t at = 0; at < text.size(); at += comment_bytes) {
        records += text.substr(at, comment_bytes);
        records.resize((records.size() + record_bytes - 1) / record_bytes * record_bytes, '\0');
    }
    return records;
}

} // namespace

std::string daf_bytes(std::string_view kind, std::string_view title, std::string_view comments,
                      const std::vector<DafArrayData>& arrays) {
    constexpr std::size_t doubles = 2;
    const std::size_t integers = kind == "PCK" ? 5 : 6;
    const std::size_t summary_words = doubles + (integers + 1) / 2;
    const std::size_t per_record = (record_words - 3) / summary_words;

    std::string bytes = padded("DAF/" + std::string(kind), record_bytes);
    std::fill(bytes.begin() + 8, bytes.end(), '\0');
    put(bytes, 8, static_cast<std::int32_t>(doubles));
    put(bytes, 12, static_cast<std::int32_t>(integers));
    bytes.replace(16, 60, padded(title, 60));
    bytes.replace(88, 8, "LTL-IEEE");
    bytes.replace(699, ftp_string.size(), ftp_string);
    bytes += comment_records(comments);
    const auto first_record = static_cast<std::int32_t>(bytes.size() / record_bytes) + 1;
    put(bytes, 76, first_record);

    // Pairs of summary and name records, each pair with the data of its arrays after it.
    std::size_t previous = 0;
    for (std::size_t first = 0; first == 0 || first < arrays.size(); first += per_record) {
        const std::size_t count = std::min(per_record, arrays.size() - first);
        const std::size_t record = bytes.size() / record_bytes + 1;
        const std::size_t summaries = bytes.size();
        const std::size_t names = summaries + record_bytes;
        bytes.append(record_bytes, '\0');
        bytes.append(record_bytes, ' ');
        if (previous != 0) put(bytes, (previous - 1) * record_bytes, static_cast<double>(record));
        put(bytes, summaries + 8, static_cast<double>(previous));
        put(bytes, summaries + 16, static_cast<double>(count));
        for (std::size_t i = 0; i < count; ++i) {
            const DafArrayData& array = arrays[first + i];
            if (array.doubles.size() != doubles || array.integers.size() != integers - 2 ||
                array.words.empty())
                throw std::logic_error("daf_bytes: a summary that does not fit the kind of file");
            const std::size_t begin = bytes.size() / sizeof(double) + 1;
            const std::size_t end = begin + array.words.size() - 1;
            if (end > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
                throw InputError("a DAF file holds at most 2^31 - 1 words: choose a shorter interval");
            std::size_t at = summaries + (3 + i * summary_words) * sizeof(double);
            for (const double d : array.doubles)
                put(bytes, at, d), at += sizeof(double);
            for (const std::int32_t n : array.integers)
                put(bytes, at, n), at += sizeof(std::int32_t);
            put(bytes, at, static_cast<std::int32_t>(begin));
            put(bytes, at + sizeof(std::int32_t), static_cast<std::int32_t>(end));
            const std::size_t name_bytes = summary_words * sizeof(double);
            bytes.replace(names + i * name_bytes, name_bytes, padded(array.name, name_bytes));
            bytes.append(reinterpret_cast<const char*>(array.words.data()),
                         array.words.size() * sizeof(double));
        }
        put(bytes, 80, static_cast<std::int32_t>(record));
        put(bytes, 84, static_cast<std::int32_t>(bytes.size() / sizeof(double) + 1));
        bytes.resize((bytes.size() + record_bytes - 1) / record_bytes * record_bytes, '\0');
        previous = record;
    }
    return bytes;
}

} // namespace obscura::ephemeris
