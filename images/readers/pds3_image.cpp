// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "images/image.hpp"
#include "images/readers/pds3_layout.hpp"

#include <fmt/format.h>

namespace obscura::images {

std::int64_t pds3_planes(const std::filesystem::path& label) {
    const std::int64_t bands = PdsLabel(label).integer("IMAGE.BANDS", 1);
    return bands > 1 && bands <= 65536 ? bands : 1;
}

Image read_pds3_image(const std::filesystem::path& file, const std::string& plane) {
    const PdsLabel label(file);
    const std::int64_t width = label.integer("IMAGE.LINE_SAMPLES"), height = label.integer("IMAGE.LINES");
    check_image_size(file, width, height);
    Pds3Samples samples(pds3_layout(label));
    const Pds3Layout& at = samples.layout();
    const std::int32_t band = plane_number(file, plane, at.bands);
    const PdsNumbers numbers = pds3_numbers(label, at.type);
    if (!numbers.possible())
        throw InputError(fmt::format("{}: SCALING_FACTOR {} and OFFSET {} are not possible", file.string(),
                                     numbers.scale, numbers.offset));
    Image image{static_cast<std::int32_t>(at.width), static_cast<std::int32_t>(at.height), {}, 1};
    image.values.resize(static_cast<std::size_t>(at.width * at.height));
    const std::span<double> all(image.values);
    for (std::int64_t y = 0; y < at.height; ++y) {
        const std::span<double> row =
            all.subspan(static_cast<std::size_t>(y * at.width), static_cast<std::size_t>(at.width));
        samples.read(band, 0, y, row);
        for (double& number : row)
            number = numbers.offset + numbers.scale * numbers.valid(number);
    }
    return image;
}

} // namespace obscura::images
