// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "images/image.hpp"
#include "images/readers/pds3_layout.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <limits>
#include <optional>

namespace obscura::images {
namespace {

double decode_samples(const Pds3SampleType& type, const std::uint8_t* at) {
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < type.bytes; ++i)
        word |= std::uint64_t{at[type.little_endian ? i : type.bytes - 1 - i]} << (8 * i);
    if (type.kind == Pds3SampleType::Kind::real)
        return type.bytes == 4 ? static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(word)))
                               : std::bit_cast<double>(word);
    if (type.kind == Pds3SampleType::Kind::signed_integer) {
        const std::uint64_t sign = std::uint64_t{1} << (8 * type.bytes - 1);
        return static_cast<double>(static_cast<std::int64_t>(word ^ sign) - static_cast<std::int64_t>(sign));
    }
    return static_cast<double>(word);
}

/// The number that marks samples without data, if the label has one: decimal, or as 16#...# the bits of a
/// sample.
std::optional<double> missing_constant(const PdsLabel& label, const Pds3SampleType& type) {
    for (const char* key : {"IMAGE.MISSING_CONSTANT", "IMAGE.MISSING", "IMAGE.NULL_CONSTANT"}) {
        if (!label.has(key)) continue;
        const std::string text = label.text(key, "");
        if (!text.starts_with("16#")) {
            double value = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            if (error != std::errc{} || end != text.data() + text.size()) continue; // "N/A"
            // A real of 32 bits holds the number rounded.
            const bool single = type.kind == Pds3SampleType::Kind::real && type.bytes == 4;
            return single ? static_cast<double>(static_cast<float>(value)) : value;
        }
        std::uint64_t bits = 0;
        const auto [end, error] = std::from_chars(text.data() + 3, text.data() + text.size(), bits, 16);
        if (error != std::errc{} || end != text.data() + text.size() - 1 || *end != '#') continue;
        std::array<std::uint8_t, 8> bytes{};
        for (std::size_t i = 0; i < type.bytes; ++i)
            bytes[type.little_endian ? i : type.bytes - 1 - i] = static_cast<std::uint8_t>(bits >> (8 * i));
        return decode_samples(type, bytes.data());
    }
    return std::nullopt;
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
    const Pds3Layout at = pds3_layout(label);
    const std::int64_t offset = at.offset + plane_number(file, plane, at.bands) * height * at.line_bytes;

    const std::filesystem::path& data = at.data;
    const InputFile in = open_input(data);
    std::error_code error;
    const auto size = static_cast<std::int64_t>(std::filesystem::file_size(data, error));
    if (error || offset + height * at.line_bytes > size + at.suffix)
        throw InputError(fmt::format("{}: {} bytes, its label describes an image up to byte {}",
                                     data.string(), error ? 0 : size, offset + height * at.line_bytes));
    if (std::fseek(in.get(), static_cast<long>(offset), SEEK_SET) != 0)
        throw InputError(fmt::format("{}: cannot be read: {}", data.string(), std::strerror(errno)));
    std::vector<std::uint8_t> line(static_cast<std::size_t>(at.line_bytes));
    const double scale = label.number("IMAGE.SCALING_FACTOR", 1), shift = label.number("IMAGE.OFFSET", 0);
    const std::optional<double> missing = missing_constant(label, at.type);
    Image image{static_cast<std::int32_t>(width), static_cast<std::int32_t>(height), {}, 1};
    image.values.reserve(static_cast<std::size_t>(width * height));
    for (std::int64_t y = 0; y < height; ++y) {
        const std::size_t wanted = line.size() - static_cast<std::size_t>(y + 1 == height ? at.suffix : 0);
        if (std::fread(line.data(), 1, wanted, in.get()) != wanted)
            throw InputError(fmt::format("{}: ends in line {} of {}", data.string(), y + 1, height));
        for (std::int64_t x = 0; x < width; ++x) {
            const double number = decode_samples(at.type, line.data() + at.prefix +
                                                              x * static_cast<std::int64_t>(at.type.bytes));
            image.values.push_back(missing && number == *missing ? std::numeric_limits<double>::quiet_NaN()
                                                                 : shift + scale * number);
        }
    }
    return image;
}

} // namespace obscura::images
