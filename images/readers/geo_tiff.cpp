// SPDX-License-Identifier: Apache-2.0
#include "images/readers/geo_tiff.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "images/readers/tiff_tags.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <string_view>

namespace obscura::images {
namespace {

struct CloseTiff {
    void operator()(TIFF* t) const { TIFFClose(t); }
};

/// Text of the first <Item role="ROLE" sample="0"> of GDAL's metadata, which GDAL writes one a line.
std::string_view item(std::string_view metadata, std::string_view role) {
    const std::string wanted = fmt::format("role=\"{}\"", role);
    for (std::size_t at = metadata.find("<Item "); at != std::string_view::npos;
         at = metadata.find("<Item ", at + 1)) {
        const std::size_t close = metadata.find('>', at), end = metadata.find("</Item>", at);
        if (close == std::string_view::npos || end == std::string_view::npos || end < close) return {};
        const std::string_view attributes = metadata.substr(at, close - at);
        const bool later = attributes.find("sample=\"") != std::string_view::npos &&
                           attributes.find("sample=\"0\"") == std::string_view::npos;
        if (!later && attributes.find(wanted) != std::string_view::npos)
            return metadata.substr(close + 1, end - close - 1);
    }
    return {};
}

std::optional<double> number(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
    return value;
}

std::vector<double> doubles(TIFF* tiff, ttag_t tag) {
    const std::span<const double> values = tag_values<double>(tiff, tag, TIFF_DOUBLE);
    return {values.begin(), values.end()};
}

} // namespace

bool is_tiff(const std::filesystem::path& file) {
    const InputFile in = open_input(file);
    std::array<char, 4> start{};
    if (std::fread(start.data(), 1, start.size(), in.get()) != start.size()) return false;
    const bool little =
        start[0] == 'I' && start[1] == 'I' && (start[2] == '*' || start[2] == '+') && start[3] == 0;
    const bool big =
        start[0] == 'M' && start[1] == 'M' && start[2] == 0 && (start[3] == '*' || start[3] == '+');
    return little || big;
}

GeoTiff read_geo_tiff(const std::filesystem::path& file) {
    require_regular_file(file);
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
    const std::unique_ptr<TIFF, CloseTiff> tiff(TIFFOpen(file.c_str(), "rm"));
    if (!tiff)
        throw InputError(fmt::format("{}: not readable as TIFF: its directory is damaged", file.string()));
    GeoTiff found;
    found.pixel_scale = doubles(tiff.get(), tag_pixel_scale);
    found.tie_points = doubles(tiff.get(), tag_tie_points);
    found.transformation = doubles(tiff.get(), tag_transformation);
    const std::vector<double> values = doubles(tiff.get(), tag_geo_doubles);
    const std::span<const std::uint16_t> keys =
        tag_values<std::uint16_t>(tiff.get(), tag_geo_keys, TIFF_SHORT);
    // Four numbers each, the first of the header: key, tag that holds the value, count, value or index.
    for (std::size_t i = 4; i + 4 <= keys.size(); i += 4) {
        if (keys[i + 1] == 0)
            found.keys[keys[i]] = keys[i + 3];
        else if (keys[i + 1] == tag_geo_doubles && keys[i + 3] < values.size())
            found.keys[keys[i]] = values[keys[i + 3]];
    }
    const std::string_view metadata = tag_text(tiff.get(), tag_gdal_metadata);
    found.scale = number(item(metadata, "scale"));
    found.offset = number(item(metadata, "offset"));
    found.unit = item(metadata, "unittype");
    return found;
}

} // namespace obscura::images
