// SPDX-License-Identifier: Apache-2.0
// Received light: irradiance on the surfaces of a scene's bodies, what they absorb, and its force and torque.
// Read this header first.
//
// Light is gathered: shadow rays to the Sun and the lamps from points of each patch, rays over the hemisphere
// to surfaces nearby, rays to the discs of bodies that are far away. Only light by way of mirrors is shot, as
// photons that are counted on the patches where they end. Surfaces are opaque and receive on the outer side.
#pragma once

#include "core/geometry.hpp"
#include "core/text/enum_names.hpp"
#include "renderer/scene/scene.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace obscura::renderer {

class Receivers;

/// Where light that falls on a surface comes from last.
enum class LightCause : std::uint8_t {
    sun,         ///< directly
    lamps,       ///< directly
    planetshine, ///< leaving a body that is far away: reflected, or its own
    bodies,      ///< leaving the body itself or one nearby: reflected, or its own
    caustic,     ///< of Sun and lamps by way of mirrors
};
inline constexpr std::size_t light_causes = 5;
constexpr auto enum_names(LightCause /*type*/) {
    using C = LightCause;
    return std::array{EnumName{C::sun, "sun"}, EnumName{C::lamps, "lamps"},
                      EnumName{C::planetshine, "planetshine"}, EnumName{C::bodies, "bodies"},
                      EnumName{C::caustic, "caustic"}};
}

/// How finely light is gathered. Bodies of few patches take more samples of each, so that their sums are no
/// worse than those of meshes.
struct ReceivedLightSettings {
    std::uint32_t points = 1;          ///< of each patch at least, with a shadow ray to each light
    std::uint32_t directions = 64;     ///< at least, over the hemisphere of each patch, to surfaces nearby
    std::uint32_t far_directions = 16; ///< at least, from each patch to each body far away
    std::uint32_t max_bounces = 20;    ///< reflections by diffuse surfaces; 0: direct light only
    std::uint64_t photons = 4'000'000; ///< towards each mirror from each light; 0: no caustics
    std::size_t rows = 90;             ///< cells from pole to pole of bodies without facets
    std::uint64_t seed = 1;
    std::uint32_t threads = 0; ///< 0: one per core
    /// The Sun's light in all bands together is that of its whole spectrum, of which each band gets its
    /// share.
    bool whole_spectrum = false;
    std::vector<std::string> bodies{}; ///< whose light is wanted; empty: all
    /// Called now and then, from any thread, with the share that is done; ends the work by returning false.
    std::function<bool(double share)> go_on{};
};

/// Sums over a body.
struct ReceivedSums {
    std::array<double, light_causes> incident_w{}; ///< in all bands
    double absorbed_w = 0, leaving_w = 0;          ///< leaving: reflected and emitted
    double emitted_w = 0;
    double lit_area_m2 = 0; ///< from which the Sun is seen
    /// Push of the light that falls on it and leaves it; the torque is about the origin of the body frame.
    Vec3 force_n, torque_nm;
};

/// Light received by a body. Arrays are by patch, then by band: [patch * bands + band].
struct BodyReceivedLight {
    std::string name;
    std::size_t bands = 0;
    std::shared_ptr<const Receivers> receivers; ///< its patches; valid as long as the map lives
    std::array<std::vector<float>, light_causes> incident_w_m2; ///< irradiance by cause; empty: none at all
    std::vector<float> absorbed_w_m2;
    std::vector<float> radiosity_w_m2; ///< that leaves, reflected by diffuse surfaces and emitted
    std::vector<float> lit_share;      ///< by patch: share of the area from which the Sun is seen
    ReceivedSums sums;                 ///< body frame
    Quat to_inertial;                  ///< turns vectors of the body frame into the inertial frame
};

/// Light received at an instant.
struct ReceivedLight {
    std::vector<BodyReceivedLight> bodies;
    std::uint32_t bounces = 0; ///< after which the light was in balance
    double inner_share = 0;    ///< of the rays between patches that met an inner side, which is dark
    std::uint64_t rays = 0;
    double solar_share = 0;         ///< of the Sun's power in the bands of the scene
    std::vector<std::string> notes; ///< for people
};

/// Light on the surfaces of a scene. What surfaces see of each other is traced once and kept while nothing
/// but the Sun moves. One call after the other; spreads over threads of its own.
class ReceivedLightMap {
public:
    /// Loads meshes and builds acceleration structures. Throws InputError or ConfigError.
    ReceivedLightMap(scene::Scene scene, ReceivedLightSettings settings);
    ~ReceivedLightMap();
    ReceivedLightMap(ReceivedLightMap&&) noexcept;
    ReceivedLightMap& operator=(ReceivedLightMap&&) noexcept;

    /// Light at a scene time; none if `go_on` ended the work.
    [[nodiscard]] std::optional<ReceivedLight> at(double time_s);
    /// The same with the Sun at another place, inertial frame.
    [[nodiscard]] std::optional<ReceivedLight> at(double time_s, Vec3 sun_m);
    [[nodiscard]] const scene::Scene& scene() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace obscura::renderer
