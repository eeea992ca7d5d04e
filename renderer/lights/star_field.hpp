// SPDX-License-Identifier: Apache-2.0
// Star field: directions and band irradiances of the stars of a catalogue.
#pragma once

#include "renderer/scene/scene.hpp"

#include <cstdint>
#include <vector>

namespace obscura::renderer {

/// Inertial unit vector (J2000 axes) of a right ascension and declination.
[[nodiscard]] Vec3 star_direction(double right_ascension_rad, double declination_rad);

/// Immutable; thread-safe.
class StarField {
public:
    /// Throws ConfigError when a star's numbers are not finite.
    StarField(const std::vector<scene::Star>& stars, const std::vector<SpectralBand>& bands);

    [[nodiscard]] std::size_t size() const { return x_.size(); }
    [[nodiscard]] Vec3 direction(std::uint32_t star) const { return {x_[star], y_[star], z_[star]}; }
    /// Irradiance of `star` in `band`, W/m2.
    [[nodiscard]] double irradiance(std::uint32_t star, std::size_t band) const {
        return irradiance_[star * bands_ + band];
    }

    /// Appends the stars within the cone about the unit vector `axis` (inertial), in catalogue order.
    void inside(Vec3 axis, double half_angle_rad, std::vector<std::uint32_t>& stars) const;

private:
    std::vector<double> x_, y_, z_;
    std::vector<double> irradiance_;
    std::size_t bands_;
};

} // namespace obscura::renderer
