// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/input_file.hpp"
#include "images/image.hpp"
#include "images/readers/pds_label.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <limits>
#include <optional>

namespace obscura::images {
namespace {

/// Bytes of the largest file that a label may describe; sums with it stay far from overflow.
constexpr std::int64_t largest_file = std::int64_t{1} << 40;

/// Encoding of a sample in the file.
struct SampleType {
    enum class Kind : std::uint8_t { unsigned_integer, signed_integer, real };
    Kind kind = Kind::unsigned_integer;
    bool little_endian = false;
    std::size_t bytes = 1;
};

SampleType sample_type(const PdsLabel& label) {
    const std::string name = label.text("IMAGE.SAMPLE_TYPE", "UNSIGNED_INTEGER");
    const std::int64_t bits = label.integer("IMAGE.SAMPLE_BITS");
    SampleType type;
    type.bytes = static_cast<std::size_t>(bits) / 8;
    const auto has = [&](const char* part) { return name.find(part) != std::string::npos; };
    type.little_endian = has("LSB") || has("PC_") || has("VAX");
    if (has("REAL") || has("FLOAT"))
        type.kind = SampleType::Kind::real;
    else if (!has("UNSIGNED"))
        type.kind = SampleType::Kind::signed_integer;
    const bool size_known = type.kind == SampleType::Kind::real ? bits == 32 || bits == 64
                                                                : bits == 8 || bits == 16 || bits == 32;
    if (!size_known || (type.kind == SampleType::Kind::real && has("VAX")))
        throw InputError(
            fmt::format("{}: samples of type {} with {} bits cannot be read, allowed are integers of 8, "
                        "16 and 32 and IEEE reals of 32 and 64 bits",
                        label.file().string(), name.substr(0, 60), bits));
    return type;
}

double decode(const SampleType& type, const std::uint8_t* at) {
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < type.bytes; ++i)
        word |= std::uint64_t{at[type.little_endian ? i : type.bytes - 1 - i]} << (8 * i);
    if (type.kind == SampleType::Kind::real)
        return type.bytes == 4 ? static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(word)))
                               : std::bit_cast<double>(word);
    if (type.kind == SampleType::Kind::signed_integer) {
        const std::uint64_t sign = std::uint64_t{1} << (8 * type.bytes - 1);
        return static_cast<double>(static_cast<std::int64_t>(word ^ sign) - static_cast<std::int64_t>(sign));
    }
    return static_cast<double>(word);
}

/// The number that marks samples without data, if the label has one: decimal, or as 16#...# the bits of a
/// sample.
std::optional<double> missing_constant(const PdsLabel& label, const SampleType& type) {
    for (const char* key : {"IMAGE.MISSING_CONSTANT", "IMAGE.MISSING", "IMAGE.NULL_CONSTANT"}) {
        if (!label.has(key)) continue;
        const std::string text = label.text(key, "");
        if (!text.starts_with("16#")) {
            double value = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            if (error != std::errc{} || end != text.data() + text.size()) continue; // "N/A"
            // A real of 32 bits holds the number rounded.
            const bool single = type.kind == SampleType::Kind::real && type.bytes == 4;
            return single ? static_cast<double>(static_cast<float>(value)) : value;
        }
        std::uint64_t bits = 0;
        const auto [end, error] = std::from_chars(text.data() + 3, text.data() + text.size(), bits, 16);
        if (error != std::errc{} || end != text.data() + text.size() - 1 || *end != '#') continue;
        std::array<std::uint8_t, 8> bytes{};
        for (std::size_t i = 0; i < type.bytes; ++i)
            bytes[type.little_endian ? i : type.bytes - 1 - i] = static_cast<std::uint8_t>(bits >> (8 * i));
        return decode(type, bytes.data());
    }
    return std::nullopt;
}

/// Finds the data file and the byte offset that ^IMAGE points to.
void locate(const PdsLabel& label, std::filesystem::path& data, std::int64_t& offset) {
    const std::vector<std::string> pointer = label.list("^IMAGE");
    data = label.file();
    std::string place = pointer.front();
    if (place.find_first_not_of("0123456789") != std::string::npos) {
        // Try other cases: names on the archive's discs are upper case, names of their copies often not.
        std::string lower = place, upper = place;
        std::transform(lower.begin(), lower.end(), lower.begin(),
                       [](unsigned char c) { return std::tolower(c); });
        std::transform(upper.begin(), upper.end(), upper.begin(),
                       [](unsigned char c) { return std::toupper(c); });
        for (const std::string& name : {place, lower, upper}) {
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
    const std::int64_t record = in_bytes ? 1 : label.integer("RECORD_BYTES");
    if (record < 1)
        throw InputError(fmt::format("{}: RECORD_BYTES {} is out of range", label.file().string(), record));
    if (offset > largest_file / record)
        throw InputError(fmt::format("{}: ^IMAGE points behind any file", label.file().string()));
    offset *= record;
}

} // namespace

std::int64_t pds3_planes(const std::filesystem::path& label) {
    const std::int64_t bands = PdsLabel(label).integer("IMAGE.BANDS", 1);
    return bands > 1 && bands <= 65536 ? bands : 1;
}

Image read_pds3_image(const std::filesystem::path& file, const std::string& plane) {
    const PdsLabel label(file);
    const std::int64_t width = label.integer("IMAGE.LINE_SAMPLES"), height = label.integer("IMAGE.LINES");
    check_image_size(file, width, height);
    const std::int64_t bands = label.integer("IMAGE.BANDS", 1);
    if (bands > 1 && label.text("IMAGE.BAND_STORAGE_TYPE", "BAND_SEQUENTIAL") != "BAND_SEQUENTIAL")
        throw InputError(fmt::format("{}: only BAND_SEQUENTIAL images can be read", file.string()));
    const SampleType type = sample_type(label);
    const std::int64_t prefix = label.integer("IMAGE.LINE_PREFIX_BYTES", 0);
    const std::int64_t suffix = label.integer("IMAGE.LINE_SUFFIX_BYTES", 0);
    if (prefix < 0 || suffix < 0 || prefix > 1 << 20 || suffix > 1 << 20 || bands < 1 || bands > 65536)
        throw InputError(fmt::format("{}: the label's image layout is invalid", file.string()));
    std::filesystem::path data;
    std::int64_t offset = 0;
    locate(label, data, offset);
    const std::int64_t line_bytes = prefix + width * static_cast<std::int64_t>(type.bytes) + suffix;
    if (line_bytes > largest_file / bands / height)
        throw InputError(fmt::format("{}: the label's image layout is invalid", file.string()));
    offset += plane_number(file, plane, bands) * height * line_bytes;

    const InputFile in = open_input(data);
    std::error_code error;
    const auto size = static_cast<std::int64_t>(std::filesystem::file_size(data, error));
    if (error || offset + height * line_bytes > size + suffix)
        throw InputError(fmt::format("{}: {} bytes, its label describes an image up to byte {}",
                                     data.string(), error ? 0 : size, offset + height * line_bytes));
    if (std::fseek(in.get(), static_cast<long>(offset), SEEK_SET) != 0)
        throw InputError(fmt::format("{}: cannot be read: {}", data.string(), std::strerror(errno)));
    std::vector<std::uint8_t> line(static_cast<std::size_t>(line_bytes));
    const double scale = label.number("IMAGE.SCALING_FACTOR", 1), shift = label.number("IMAGE.OFFSET", 0);
    const std::optional<double> missing = missing_constant(label, type);
    Image image{static_cast<std::int32_t>(width), static_cast<std::int32_t>(height), {}, 1};
    image.values.reserve(static_cast<std::size_t>(width * height));
    for (std::int64_t y = 0; y < height; ++y) {
        const std::size_t wanted = line.size() - static_cast<std::size_t>(y + 1 == height ? suffix : 0);
        if (std::fread(line.data(), 1, wanted, in.get()) != wanted)
            throw InputError(fmt::format("{}: ends in line {} of {}", data.string(), y + 1, height));
        for (std::int64_t x = 0; x < width; ++x) {
            const double number =
                decode(type, line.data() + prefix + x * static_cast<std::int64_t>(type.bytes));
            image.values.push_back(missing && number == *missing ? std::numeric_limits<double>::quiet_NaN()
                                                                 : shift + scale * number);
        }
    }
    return image;
}

} // namespace obscura::images
