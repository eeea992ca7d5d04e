// SPDX-License-Identifier: Apache-2.0
// Tables [[body.height]] of scene files: height maps of a planet or terrain and how they are laid over each
// other.
#pragma once

#include "config/section.hpp"
#include "terrain/maps/height_stack.hpp"
#include "terrain/maps/map_findings.hpp"
#include "terrain/maps/map_source.hpp"
#include "terrain/surface_domain.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::renderer {

/// One table.
struct HeightTable {
    std::string file;
    terrain::MapKeys map;
    std::int32_t priority = 0;
    double feather_m = 0; ///< 0: by the pixels
    terrain::PatchMatch match = terrain::PatchMatch::none;
};

/// The list of tables; `tables` must outlive it.
[[nodiscard]] config::List height_list(std::vector<HeightTable>& tables);

/// All values of the tables, as text: tables of the same text make the same surface.
[[nodiscard]] std::string identity_of(const std::vector<HeightTable>& tables);

/// Opens the maps and makes layers of them, from the lowest upwards. `notes`: lines on overlaps and on what
/// is odd. Throws InputError.
[[nodiscard]] std::vector<std::shared_ptr<const terrain::HeightLayer>>
open_heights(const std::vector<HeightTable>& tables, const terrain::SurfaceDomain& domain,
             terrain::MapFindings& found);

} // namespace obscura::renderer
