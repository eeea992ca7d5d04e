// SPDX-License-Identifier: Apache-2.0
// Description of a giant texture (.obt): what its samples are, and where they lie on a body.
#pragma once

#include "core/geometry.hpp"
#include "core/text/enum_names.hpp"
#include "terrain/geometry/map_frame.hpp"
#include "terrain/geometry/projection.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace obscura::terrain {

enum class ObtKind : std::uint8_t {
    heights,   ///< m
    albedo,    ///< factors of the reflectance, linear
    parameter, ///< any other quantity: parameters of materials, normals, emission
};
constexpr auto enum_names(ObtKind /*type*/) {
    return std::array{EnumName{ObtKind::heights, "heights"}, EnumName{ObtKind::albedo, "albedo"},
                      EnumName{ObtKind::parameter, "parameter"}};
}

enum class SampleType : std::uint8_t { u8, i16, u16, f16, f32 };
constexpr auto enum_names(SampleType /*type*/) {
    return std::array{EnumName{SampleType::u8, "u8"}, EnumName{SampleType::i16, "i16"},
                      EnumName{SampleType::u16, "u16"}, EnumName{SampleType::f16, "f16"},
                      EnumName{SampleType::f32, "f32"}};
}
[[nodiscard]] constexpr std::size_t bytes_of(SampleType type) {
    return type == SampleType::u8 ? 1 : type == SampleType::f32 ? 4 : 2;
}

/// 128 bits that name the content: files with the same content have the same.
using ObtUuid = std::array<std::uint8_t, 16>;
/// "01234567-89ab-...".
[[nodiscard]] std::string uuid_text(const ObtUuid& uuid);

/// Range of one plane's finest samples, in values, and their mean; whether samples are missing.
struct ObtPlaneStatistics {
    double least = 0, largest = 0, mean = 0;
    bool holes = false;
    bool operator==(const ObtPlaneStatistics&) const = default;
};

/// Contents of the header of a file but for the places of its parts. A sample's value is offset + scale *
/// number, where `number` is what is stored; missing samples are NaN.
struct ObtMetadata {
    ObtKind kind = ObtKind::heights;
    SampleType type = SampleType::u16;
    /// Only with u16: numbers are multiples of a power of two that each tile chooses for itself, not only
    /// whole numbers from 0 to 65535. Tiles whose range is too large for it hold f32.
    bool lattice = false;
    /// Steps of lattices: from 2^finest_exponent up to 2^coarsest_exponent.
    int finest_exponent = -4, coarsest_exponent = 0;
    std::uint32_t planes = 1;
    bool rgb = false; ///< three planes: red, green, blue (650, 550, 450 nm)
    std::int64_t width = 0, height = 0;
    double scale = 1, offset = 0;
    /// Number of missing samples where the type has no NaN (u8, i16, u16 without lattice); without one, no
    /// sample may be missing.
    std::optional<std::int32_t> nodata;

    Registration registration = Registration::pixel;
    PixelTransform transform{0, 1, 0, 0, 0, -1};
    Projection projection;
    /// Reference surface of the heights; 0: none (planar).
    Vec3 semi_axes_m;
    HeightMeaning height_meaning = HeightMeaning::height;
    std::string unit = "m"; ///< of values; 31 bytes at most
    /// For people: 127, 127 and 511 bytes at most.
    std::string title, licence, source;

    /// Set by the writer.
    ObtUuid uuid{};
    std::vector<ObtPlaneStatistics> statistics;

    bool operator==(const ObtMetadata&) const = default;

    /// Where the samples of the finest level are. Throws as its constructor does.
    [[nodiscard]] MapFrame frame() const { return {projection, transform, registration, width, height}; }
};

inline constexpr std::uint32_t max_obt_planes = 16;
/// Largest width and height, samples.
inline constexpr std::int64_t max_obt_samples = std::int64_t{1} << 40;

/// Throws InputError `name: what is wrong, what is allowed` if no file may have this description.
void validate(const ObtMetadata& metadata, const std::string& name);

/// Levels of a raster: each has half the size of the one before, rounded up; the last fits in one tile.
[[nodiscard]] int obt_levels(std::int64_t width, std::int64_t height);

} // namespace obscura::terrain
