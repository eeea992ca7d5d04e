// SPDX-License-Identifier: Apache-2.0
// Private tags of TIFF files that libtiff does not know by itself: those of GeoTIFF and of GDAL.
#pragma once

#include <tiffio.h>

#include <cstddef>
#include <span>
#include <string_view>

namespace obscura::images {

inline constexpr ttag_t tag_pixel_scale = 33550, tag_tie_points = 33922, tag_transformation = 34264,
                        tag_geo_keys = 34735, tag_geo_doubles = 34736, tag_gdal_metadata = 42112,
                        tag_gdal_nodata = 42113;

/// Values of a tag, if the file has it with that type; valid until the file is closed.
template<typename Value>
[[nodiscard]] std::span<const Value> tag_values(TIFF* tiff, ttag_t tag, TIFFDataType type) {
    const TIFFField* const field = TIFFFindField(tiff, tag, TIFF_ANY);
    if (field == nullptr || TIFFFieldDataType(field) != type || TIFFFieldPassCount(field) == 0 ||
        TIFFFieldReadCount(field) != TIFF_VARIABLE2)
        return {};
    std::uint32_t count = 0;
    const Value* values = nullptr;
    if (TIFFGetField(tiff, tag, &count, &values) != 1 || values == nullptr) return {};
    return {values, count};
}

/// Text of a tag up to its first zero; empty: none.
[[nodiscard]] inline std::string_view tag_text(TIFF* tiff, ttag_t tag) {
    const std::span<const char> text = tag_values<char>(tiff, tag, TIFF_ASCII);
    const std::string_view whole(text.data(), text.size());
    return whole.substr(0, whole.find('\0'));
}

} // namespace obscura::images
