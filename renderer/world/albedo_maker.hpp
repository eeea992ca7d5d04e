// SPDX-License-Identifier: Apache-2.0
// Albedo maps of planets and terrains, opened from the tables of their scene.
#pragma once

#include "renderer/planets/albedo_tables.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/textures/nested_albedo.hpp"
#include "terrain/surface_domain.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace obscura::renderer {

/// Opens the maps; null: no tables. Throws InputError.
[[nodiscard]] std::shared_ptr<const NestedAlbedo> open_albedo(const std::vector<AlbedoTable>& tables,
                                                              const terrain::SurfaceDomain& domain,
                                                              const std::vector<SpectralBand>& bands);

/// Opens the maps of bodies; those of the same files and settings share theirs. `bands` must outlive it.
class AlbedoMaker {
public:
    explicit AlbedoMaker(const std::vector<SpectralBand>& bands) : bands_(bands) {}

    /// Null: the shape has no albedo maps. Throws InputError.
    [[nodiscard]] std::shared_ptr<const NestedAlbedo> make(const scene::Shape& shape);

private:
    const std::vector<SpectralBand>& bands_;
    std::map<std::string, std::shared_ptr<const NestedAlbedo>> made_;
};

} // namespace obscura::renderer
