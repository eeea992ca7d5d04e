// SPDX-License-Identifier: Apache-2.0
// What the numbers of imported maps mean: unit, reference surface, type of the texture.
#pragma once

#include "terrain/obt/obt_metadata.hpp"
#include "tools/import/map/map_source.hpp"

#include <optional>
#include <string>

namespace obscura::tools {

/// Some numbers of the maps, to tell heights from radii and metres from kilometres.
struct NumberProbe {
    double least = 0, largest = 0;
    bool any = false;
};

/// How numbers become values of the texture.
struct MapValues {
    double scale = 1, offset = 0; ///< value = offset + scale * (number - shift)
    double shift = 0;             ///< only where the texture holds f32
    Vec3 semi_axes_m;
    terrain::HeightMeaning meaning = terrain::HeightMeaning::height;
    std::string unit;
};

/// `whole` texture type: f32 keeps numbers minus a shift. Throws InputError if heights have no reference
/// surface.
[[nodiscard]] MapValues map_values(const MapSource& map, const NumberProbe& probe, terrain::SampleType type,
                                   const MapSettings& settings, MapRemarks& remarks);

/// The type that keeps the files' numbers, and the number of missing samples: `holes` says whether the
/// texture has such.
struct MapType {
    terrain::SampleType type{};
    std::optional<std::int32_t> nodata;
};
[[nodiscard]] MapType map_type(const MapNumbers& numbers, const std::string& driver, bool resampled,
                               bool holes);

} // namespace obscura::tools
