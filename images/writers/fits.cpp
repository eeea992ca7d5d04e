// SPDX-License-Identifier: Apache-2.0
#include "images/writers/fits.hpp"

#include "images/writers/fits_writer.hpp"

#include <string>

namespace obscura::images {
void write_fits16(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                  std::span<const std::uint16_t> pixels, const Cards& cards) {
    FitsWriter writer(file);
    writer.create_image(USHORT_IMG, width, height, 1);
    writer.write({"BUNIT", std::string("adu"), "digital numbers"});
    writer.write({"ROWORDER", std::string("TOP-DOWN"), "first row is the top of the image"});
    for (const Card& card : cards)
        writer.write(card);
    writer.write_pixels(TUSHORT, pixels.size(), pixels.data());
    writer.commit();
}

void write_fits_float(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                      std::int32_t planes, std::span<const float> values, std::string_view unit,
                      const Cards& cards) {
    write_fits_float(file, width, height, planes, values, unit, cards, {});
}

void write_fits_float(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                      std::int32_t planes, std::span<const float> values, std::string_view unit,
                      const Cards& cards, const std::vector<FitsPlane>& further) {
    FitsWriter writer(file);
    writer.create_image(FLOAT_IMG, width, height, planes);
    writer.write({"BUNIT", std::string(unit), "of the pixel values"});
    writer.write({"ROWORDER", std::string("TOP-DOWN"), "first row is the top of the image"});
    for (const Card& card : cards)
        writer.write(card);
    writer.write_pixels(TFLOAT, values.size(), values.data());
    for (const FitsPlane& plane : further) {
        writer.create_image(FLOAT_IMG, width, height, 1);
        writer.write({"EXTNAME", plane.name, "what the pixels hold"});
        if (!plane.unit.empty()) writer.write({"BUNIT", plane.unit, "of the pixel values"});
        writer.write({"ROWORDER", std::string("TOP-DOWN"), "first row is the top of the image"});
        writer.write_pixels(TFLOAT, plane.values.size(), plane.values.data());
    }
    writer.commit();
}

} // namespace obscura::images
