// The tables of keys of a scene file, and the plain structs they fill before a scene is made of them.
#pragma once

#include "config/keys.hpp"
#include "renderer/scene/scene.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::scene {

/// [sun]: position_m, or direction and distance_au.
struct SunKeys {
    Vec3 position_m{};
    Vec3 direction{-1, 0, 0}; ///< from the origin towards the Sun
    double distance_au = 1;
    double radius_m = scene::Sun{}.radius_m;
    double irradiance_scale = 1;
    double limb_darkening = 0;
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

/// How a body, a lamp or the camera hangs on a body.
struct JointKeys {
    std::string parent;
    scene::Joint::Kind kind = scene::Joint::Kind::fixed;
    Vec3 axis{0, 0, 1};
    double angle_deg = 0, offset_m = 0;
    std::string table;
};

/// [[body]]: what every body has; shape and material add their own keys (renderer/scene/kinds.hpp).
struct BodyKeys {
    std::string name;
    std::string shape;
    std::string material = "lambert";
    std::vector<double> colour, emission_w_m2_sr;
    std::vector<SpectralPoint> colour_curve;
    scene::Textures textures;
    JointKeys joint;
    PlaceKeys place;
};

/// The keys that let an image give one parameter of a body's material.
struct ParameterTextureKeys {
    std::string parameter;    ///< without the unit
    std::string constant_key; ///< the key of the constant
    std::string file_key, range_key;
    std::string help;
    std::string_view unit;
    double si = 1; ///< the key's unit in SI
    std::string file;
    std::array<double, 2> range{0, 1};
};
/// One for each number among `material`, the keys of a material, but the albedo.
[[nodiscard]] std::vector<ParameterTextureKeys> parameter_textures(const config::Keys& material);
/// `textures` must stay where it is while the keys are used.
[[nodiscard]] config::Keys keys_of(std::vector<ParameterTextureKeys>& textures);

/// [[lamp]]
struct LampKeys {
    std::string name;
    std::string beam = "point";
    double half_angle_deg = 10;
    std::vector<double> intensity_w_sr;
    JointKeys joint;
    PlaceKeys place;
};

[[nodiscard]] config::Keys keys_of(scene::Scene& scene);
[[nodiscard]] config::Keys keys_of(SunKeys& sun);
[[nodiscard]] config::Keys keys_of(StarKeys& stars);
[[nodiscard]] config::Keys keys_of(scene::Camera& camera);
[[nodiscard]] config::Keys camera_place_keys(PlaceKeys& place);
[[nodiscard]] config::Keys keys_of(BodyKeys& body);
[[nodiscard]] config::Keys body_place_keys(PlaceKeys& place);
[[nodiscard]] config::Keys keys_of(JointKeys& joint);
[[nodiscard]] config::Keys keys_of(LampKeys& lamp);
[[nodiscard]] config::Keys keys_of(SpectralBand& band);
[[nodiscard]] config::Keys keys_of(scene::StrayLight& stray);

} // namespace obscura::scene
