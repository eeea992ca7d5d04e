// SPDX-License-Identifier: Apache-2.0
// What the command line of `obscura import map` says in place of the labels of its files.
#pragma once

#include "core/geometry.hpp"
#include "terrain/geometry/map_frame.hpp"
#include "terrain/obt/obt_metadata.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {

struct MapSettings {
    terrain::ObtKind kind = terrain::ObtKind::heights;
    /// Name of a parameter: "roughness".
    std::string parameter;
    /// Counted from 1; none: the first, or red, green and blue of a colour image of albedo.
    std::optional<std::uint32_t> band;
    /// Metres per unit of heights.
    std::optional<double> unit_m;
    /// Semi-axes of the reference surface.
    std::optional<Vec3> radii_m;
    std::optional<terrain::HeightMeaning> meaning;
    /// Longitudes of the left and right edge and latitudes of the top and bottom edge, degrees (of the outer
    /// samples of a grid of nodes).
    std::optional<std::array<double, 4>> edges_deg;
    /// Longitudes of labels and of edges_deg grow westwards.
    bool west_positive = false;
    std::optional<terrain::Latitudes> latitudes;
    std::optional<terrain::Registration> registration;
    /// Added to the places of all samples, pixels to the right and down.
    double shift_columns = 0, shift_rows = 0;
    /// Planar terrain with pixels of this size, its middle at the origin; 0: of the size in the file.
    std::optional<double> planar_pixel_m;
    /// Value = offset + scale * number, and the number of missing samples.
    std::optional<double> scale, offset, nodata;
};

/// Notes and warnings of an import, each said once.
class MapRemarks {
public:
    void note(std::string text) { add(notes_, std::move(text)); }
    void warn(std::string text) { add(warnings_, std::move(text)); }
    [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
    [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

private:
    static void add(std::vector<std::string>& list, std::string text) {
        for (const std::string& known : list)
            if (known == text) return;
        list.push_back(std::move(text));
    }
    std::vector<std::string> notes_, warnings_;
};

} // namespace obscura::tools
