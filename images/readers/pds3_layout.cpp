// SPDX-License-Identifier: Apache-2.0
#include "images/readers/pds3_layout.hpp"

#include "core/error.hpp"
#include "core/text/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace obscura::images {
namespace {

/// Bytes of the largest file that a label may describe; sums with it stay far from overflow.
constexpr std::int64_t largest_file = std::int64_t{1} << 40;

Pds3SampleType sample_type(const PdsLabel& label) {
    const std::string name = label.text("IMAGE.SAMPLE_TYPE", "UNSIGNED_INTEGER");
    const std::int64_t bits = label.integer("IMAGE.SAMPLE_BITS");
    Pds3SampleType type;
    type.bytes = static_cast<std::size_t>(bits) / 8;
    const auto has = [&](const char* part) { return name.find(part) != std::string::npos; };
    type.little_endian = has("LSB") || has("PC_") || has("VAX");
    if (has("REAL") || has("FLOAT"))
        type.kind = Pds3SampleType::Kind::real;
    else if (!has("UNSIGNED"))
        type.kind = Pds3SampleType::Kind::signed_integer;
    const bool size_known = type.kind == Pds3SampleType::Kind::real
                                ? bits == 32 || bits == 64
                                : bits == 8 || bits == 16 || bits == 32 || bits == 64;
    if (!size_known || (type.kind == Pds3SampleType::Kind::real && has("VAX")))
        throw InputError(fmt::format(
            "{}: samples of type {} with {} bits cannot be read, allowed are integers of 8, 16, 32 and 64 and IEEE reals of 32 and 64 bits",
            label.file().string(), name.substr(0, 60), bits));
    return type;
}

/// Finds the data file and the byte offset that ^IMAGE points to.
void locate(const PdsLabel& label, std::filesystem::path& data, std::int64_t& offset) {
    const std::vector<std::string> pointer = label.list("^IMAGE");
    data = label.file();
    std::string place = pointer.front();
    if (place.find_first_not_of("0123456789") != std::string::npos) {
        // Try other cases: names on the archive's discs are upper case, names of their copies often not.
        for (const std::string& name : {place, lower_case(place), upper_case(place)}) {
            // Use the file name only, so that a label cannot refer to files outside its folder.
            data = label.file().parent_path() / std::filesystem::path(name).filename();
            if (std::filesystem::exists(data)) break;
        }
        place = pointer.size() > 1 ? pointer[1] : "1";
    }
    offset = 0;
    const auto unit = place.find('<');
    const bool in_bytes = label.unit("^IMAGE") == "BYTES";
    const std::string digits = place.substr(0, unit == std::string::npos ? place.size() : unit);
    try {
        offset = std::stoll(digits);
    } catch (const std::exception&) {
        throw InputError(fmt::format("{}: ^IMAGE is not a valid pointer", label.file().string()));
    }
    if (offset < 1) throw InputError(fmt::format("{}: ^IMAGE points before the file", label.file().string()));
    offset -= 1;
    if (offset == 0) return; // whatever a record is
    const std::int64_t record = in_bytes ? 1 : label.integer("RECORD_BYTES");
    if (record < 1)
        throw InputError(fmt::format("{}: RECORD_BYTES {} is out of range", label.file().string(), record));
    if (offset > largest_file / record)
        throw InputError(fmt::format("{}: ^IMAGE points behind any file", label.file().string()));
    offset *= record;
}

} // namespace

Pds3Layout pds3_layout(const PdsLabel& label) {
    Pds3Layout at;
    const std::filesystem::path& file = label.file();
    at.width = label.integer("IMAGE.LINE_SAMPLES");
    at.height = label.integer("IMAGE.LINES");
    at.bands = label.integer("IMAGE.BANDS", 1);
    at.type = sample_type(label);
    at.prefix = label.integer("IMAGE.LINE_PREFIX_BYTES", 0);
    at.suffix = label.integer("IMAGE.LINE_SUFFIX_BYTES", 0);
    const auto possible = [](std::int64_t n, std::int64_t most) { return n >= 0 && n <= most; };
    if (!possible(at.prefix, 1 << 20) || !possible(at.suffix, 1 << 20) || !possible(at.bands - 1, 65535) ||
        !possible(at.width - 1, largest_file) || !possible(at.height - 1, largest_file))
        throw InputError(fmt::format("{}: the label's image layout is invalid", file.string()));
    locate(label, at.data, at.offset);
    const std::string storage = at.bands > 1
                                    ? upper_case(label.text("IMAGE.BAND_STORAGE_TYPE", "BAND_SEQUENTIAL"))
                                    : "BAND_SEQUENTIAL";
    const bool by_sample = storage == "SAMPLE_INTERLEAVED", by_line = storage == "LINE_INTERLEAVED";
    if (!by_sample && !by_line && storage != "BAND_SEQUENTIAL")
        throw InputError(fmt::format(
            "{}: BAND_STORAGE_TYPE is {}, allowed BAND_SEQUENTIAL, LINE_INTERLEAVED, SAMPLE_INTERLEAVED",
            file.string(), storage.substr(0, 60)));
    const auto bytes = static_cast<std::int64_t>(at.type.bytes);
    at.interleaved = by_sample || by_line;
    at.sample_bytes = by_sample ? at.bands * bytes : bytes;
    if (at.width > largest_file / at.sample_bytes)
        throw InputError(fmt::format("{}: the label's image layout is invalid", file.string()));
    at.line_bytes = at.prefix + at.width * at.sample_bytes + at.suffix;
    if (at.line_bytes > largest_file / at.bands / at.height)
        throw InputError(fmt::format("{}: the label's image layout is invalid", file.string()));
    at.row_bytes = by_line ? at.line_bytes * at.bands : at.line_bytes;
    at.band_bytes = by_sample ? bytes : by_line ? at.line_bytes : at.line_bytes * at.height;
    return at;
}

} // namespace obscura::images
