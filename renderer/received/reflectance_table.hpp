// SPDX-License-Identifier: Apache-2.0
// Reflectance table: hemispherical reflectance of a law, and the momentum of the light that it reflects.
#pragma once

#include "renderer/materials/material.hpp"

#include <cstddef>
#include <vector>

namespace obscura::renderer {

/// What a surface does with collimated light, per unit of power that falls on it, in one channel.
struct Reflected {
    double share = 0;   ///< directional-hemispherical reflectance
    double normal = 0;  ///< momentum times c along the normal
    double tangent = 0; ///< and along the light's direction on the surface, which points to the source
};

/// Tables over the cosine of incidence, linear in between, of a law with its own parameters. Immutable;
/// thread-safe.
class ReflectanceTable {
public:
    /// `channels`: those of Material::reflectances() for a spectral law, else one counts for all.
    ReflectanceTable(const Material& material, std::size_t channels);

    /// `cos_in` in [0, 1].
    [[nodiscard]] Reflected at(double cos_in, std::size_t channel) const;
    /// Mean of the share over diffuse light: the bihemispherical reflectance.
    [[nodiscard]] double diffuse(std::size_t channel) const { return diffuse_[spectral_ ? channel : 0]; }
    [[nodiscard]] bool mirror() const { return mirror_; }

private:
    static constexpr std::size_t nodes = 65;

    bool mirror_ = false, spectral_ = false;
    std::vector<Reflected> table_; ///< by channel and node
    std::vector<double> diffuse_;
};

} // namespace obscura::renderer
