// SPDX-License-Identifier: Apache-2.0
// Messages between obscura and its helper process obscura-gdal, over a pair of pipes.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::tools {

/// A message is a header of 16 bytes (kind, 0, length of the body) and its body; both programs run on one
/// machine and use its byte order. Each request has one answer.
enum class GdalMessage : std::uint32_t {
    // Requests.
    open = 1,      ///< path: answered by `opened`
    read = 2,      ///< GdalBlock: answered by `samples`
    transform = 3, ///< GdalTransform: answered by `points`
    // Answers.
    opened = 101,  ///< GdalMap
    samples = 102, ///< rows * columns samples of the band's type
    points = 103,  ///< x, y in f64 for each point
    refused = 104, ///< text: why
};

struct GdalHeader {
    GdalMessage kind{};
    std::uint32_t zero = 0;
    std::uint64_t bytes = 0;
};
static_assert(sizeof(GdalHeader) == 16);

/// Longest body, bytes. Blocks are asked for in pieces below this.
inline constexpr std::uint64_t gdal_message_limit = std::uint64_t{64} << 20;
/// Bands that are described.
inline constexpr std::uint32_t gdal_band_limit = 64;

enum class GdalType : std::uint8_t { u8, i8, u16, i16, u32, i32, f32, f64 };
constexpr auto enum_names(GdalType /*type*/) {
    return std::array{EnumName{GdalType::u8, "u8"},   EnumName{GdalType::i8, "i8"},
                      EnumName{GdalType::u16, "u16"}, EnumName{GdalType::i16, "i16"},
                      EnumName{GdalType::u32, "u32"}, EnumName{GdalType::i32, "i32"},
                      EnumName{GdalType::f32, "f32"}, EnumName{GdalType::f64, "f64"}};
}
[[nodiscard]] constexpr std::size_t bytes_of(GdalType type) {
    switch (type) {
    case GdalType::u8:
    case GdalType::i8:
        return 1;
    case GdalType::u16:
    case GdalType::i16:
        return 2;
    case GdalType::f64:
        return 8;
    default:
        return 4;
    }
}

/// One band as its file has it.
struct GdalBand {
    GdalType type{};
    std::uint32_t block_width = 0, block_height = 0;
    bool palette = false; ///< samples are numbers of colours
    bool masked = false;  ///< a mask or a band of opacity says which samples are valid
    std::optional<double> nodata, scale, offset;
    std::string unit;
};

/// Coordinate system of a file.
enum class GdalSystem : std::uint8_t { none, geographic, projected, local };

/// What GDAL knows of a file.
struct GdalMap {
    std::uint32_t id = 0; ///< of the file, in requests
    std::string driver;   ///< "GTiff"
    std::int64_t width = 0, height = 0;
    std::vector<GdalBand> bands; ///< at most gdal_band_limit
    std::uint32_t band_count = 0;
    /// x = t[0] + t[1] * column + t[2] * row, y likewise, (0, 0) at the outer corner of the first pixel.
    std::optional<std::array<double, 6>> transform;
    GdalSystem system = GdalSystem::none;
    std::string method; ///< of the projection, "Polar_Stereographic"
    /// Parameters of the projection in metres and degrees, "latitude_of_origin".
    std::vector<std::pair<std::string, double>> parameters;
    double semi_major_m = 0, semi_minor_m = 0; ///< 0: unknown
    double metres_per_unit = 1;                ///< of a projected system
    double degrees_per_unit = 1;               ///< of a geographic system
    double prime_meridian_deg = 0;
    /// Key and value: of the file, and of labels under the keys "label:ISIS3", "label:PDS4".
    std::vector<std::pair<std::string, std::string>> texts;
    std::vector<std::string> warnings;
};

struct GdalBlock {
    std::uint32_t id = 0, band = 1; ///< bands count from 1
    bool mask = false;              ///< the band's mask (u8, 0: not valid) instead of its samples
    std::int64_t x = 0, y = 0;
    std::uint32_t columns = 0, rows = 0;
};

/// Longitude and latitude, degrees, of the file's own geographic system to map coordinates, or back; NaN:
/// there is none.
struct GdalTransform {
    std::uint32_t id = 0;
    bool inverse = false; ///< from map coordinates
    std::vector<std::array<double, 2>> points;
};

/// A message that is cut off, too long or of impossible content.
class GdalProtocolError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Bodies of messages. The readers throw GdalProtocolError.
[[nodiscard]] std::string encoded(const GdalMap& map);
[[nodiscard]] std::string encoded(const GdalBlock& block);
[[nodiscard]] std::string encoded(const GdalTransform& transform);
[[nodiscard]] GdalMap decoded_map(std::span<const std::byte> body);
[[nodiscard]] GdalBlock decoded_block(std::span<const std::byte> body);
[[nodiscard]] GdalTransform decoded_transform(std::span<const std::byte> body);

/// `text` as one line without control characters, of at most 400 bytes.
[[nodiscard]] std::string one_line(std::string_view text);

} // namespace obscura::tools
