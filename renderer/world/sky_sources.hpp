// SPDX-License-Identifier: Apache-2.0
// Light of the sky objects that move or vary, at an instant.
#pragma once

#include "renderer/scene/sky_object.hpp"
#include "renderer/world/row_state.hpp"

#include <optional>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Where a sky object is seen.
struct SkySource {
    Vec3 direction;             ///< unit, inertial
    double distance_m = no_hit; ///< no_hit: infinite
    double magnitude_v = 0;     ///< apparent
};

/// Sky objects that are not as stars of a catalogue. Immutable; thread-safe.
class SkySources {
public:
    explicit SkySources(const scene::Scene& scene);

    [[nodiscard]] std::size_t size() const { return moving_.size(); }
    [[nodiscard]] const scene::SkyObject& object(std::size_t i) const { return *moving_[i]; }
    /// Where object `i` is seen by a camera; nothing where it is at the camera or the Sun. Real-time safe.
    [[nodiscard]] std::optional<SkySource> at(std::size_t i, const std::vector<BuiltBody>& bodies,
                                              Vec3 camera_m, double time_s) const;
    /// Irradiances of object `i` in the bands, W/m2. Real-time safe.
    void irradiance(std::size_t i, const SkySource& source, std::span<double> irradiance_w_m2) const;

    /// A galaxy, which is shown as points of a StarField.
    struct Galaxy {
        const scene::SkyObject* object = nullptr;
        Vec3 direction; ///< of its centre: unit, J2000
        std::vector<double> irradiance_w_m2;
    };
    [[nodiscard]] std::span<const Galaxy> galaxies() const { return galaxies_; }

private:
    const scene::Scene& scene_;
    std::vector<const scene::SkyObject*> moving_;
    std::vector<Galaxy> galaxies_;
    std::vector<double> zero_w_m2_; ///< at V = 0: bands of the first object, then of the next one
};

} // namespace obscura::renderer
