// The tables of keys of a scene file, and the plain structs they fill before a scene is made of them.
#pragma once

#include "config/keys.hpp"
#include "core/scene.hpp"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace obscura::config {

/// [sun]: position_m, or direction and distance_au.
struct SunKeys {
    Vec3 position_m{};
    Vec3 direction{-1, 0, 0}; ///< from the origin towards the Sun
    double distance_au = 1;
    double radius_m = scene::Sun{}.radius_m;
    double irradiance_scale = 1;
};

/// [stars]
struct StarKeys {
    std::string catalogue;
    double limiting_magnitude = 20;
};

/// Place, attitude and motion of the camera or of a body.
struct PlaceKeys {
    Vec3 position_m;
    Quat orientation;
    Vec3 boresight{0, 0, 1}, up{0, -1, 0}, look_at_m;
    std::string trajectory;
    Vec3 spin_axis{0, 0, 1};
    double spin_rate_deg_per_s = 0;
};

/// [[body]]
struct BodyKeys {
    std::string name;
    std::string shape;
    Vec3 radii_m;
    std::string file;
    double metres_per_unit = 1;
    bool smooth_normals = true;
    double mean_radius_m = 0;
    Vec3 axis_ratios = scene::ProceduralBody{}.axis_ratios;
    std::uint64_t seed = scene::ProceduralBody{}.seed;
    std::uint32_t subdivisions = scene::ProceduralBody{}.subdivisions;
    std::string material = "lambert";
    double albedo = 0;
    PlaceKeys place;
};

[[nodiscard]] Keys keys_of(scene::Scene& scene);
[[nodiscard]] Keys keys_of(SunKeys& sun);
[[nodiscard]] Keys keys_of(StarKeys& stars);
[[nodiscard]] Keys keys_of(scene::Camera& camera);
[[nodiscard]] Keys camera_place_keys(PlaceKeys& place);
[[nodiscard]] Keys keys_of(BodyKeys& body);
[[nodiscard]] Keys body_place_keys(PlaceKeys& place);
[[nodiscard]] Keys keys_of(scene::SpectralBand& band);

/// Keys of [[body]] that only some shapes have, with those shapes.
[[nodiscard]] const std::vector<std::pair<std::string_view, std::vector<std::string_view>>>& shape_of_keys();

} // namespace obscura::config
