// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "images/image.hpp"
#include "images/readers/pds3_numbers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <vector>

namespace obscura::images {

std::int64_t pds3_planes(const std::filesystem::path& label) {
    const std::int64_t bands = PdsLabel(label).integer("IMAGE.BANDS", 1);
    return bands > 1 && bands <= 65536 ? bands : 1;
}

Image read_pds3_image(const std::filesystem::path& file, const std::string& plane) {
    const PdsLabel label(file);
    const std::int64_t width = label.integer("IMAGE.LINE_SAMPLES"), height = label.integer("IMAGE.LINES");
    check_image_size(file, width, height);
    const Pds3Layout at = pds3_layout(label);
    const std::int64_t offset = at.offset + plane_number(file, plane, at.bands) * at.band_bytes;

    const std::filesystem::path& data = at.data;
    const InputFile in = open_input(data);
    std::error_code error;
    const auto size = static_cast<std::int64_t>(std::filesystem::file_size(data, error));
    // What is behind the last sample need not be there.
    const std::int64_t line_bytes =
        at.prefix + (width - 1) * at.sample_bytes + static_cast<std::int64_t>(at.type.bytes);
    const std::int64_t end = offset + (height - 1) * at.row_bytes + line_bytes;
    if (error || end > size)
        throw InputError(fmt::format("{}: {} bytes, its label describes an image up to byte {}",
                                     data.string(), error ? 0 : size, end));
    std::vector<std::uint8_t> line(static_cast<std::size_t>(line_bytes));
    const double scale = label.number("IMAGE.SCALING_FACTOR", 1), shift = label.number("IMAGE.OFFSET", 0);
    const std::vector<double> missing = pds3_missing(label, at.type);
    Image image{static_cast<std::int32_t>(width), static_cast<std::int32_t>(height), {}, 1};
    image.values.reserve(static_cast<std::size_t>(width * height));
    for (std::int64_t y = 0; y < height; ++y) {
        if (std::fseek(in.get(), static_cast<long>(offset + y * at.row_bytes), SEEK_SET) != 0)
            throw InputError(fmt::format("{}: cannot be read: {}", data.string(), std::strerror(errno)));
        if (std::fread(line.data(), 1, line.size(), in.get()) != line.size())
            throw InputError(fmt::format("{}: ends in line {} of {}", data.string(), y + 1, height));
        for (std::int64_t x = 0; x < width; ++x) {
            const double number = pds3_sample(at.type, line.data() + at.prefix + x * at.sample_bytes);
            const bool none = std::find(missing.begin(), missing.end(), number) != missing.end();
            image.values.push_back(none ? std::numeric_limits<double>::quiet_NaN() : shift + scale * number);
        }
    }
    return image;
}

} // namespace obscura::images
