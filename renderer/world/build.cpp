// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/build.hpp"

#include "core/camera/pixel_pitch.hpp"
#include "core/error.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/materials/model_material.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/registries/registry.hpp"
#include "renderer/registries/shape_cache.hpp"
#include "renderer/scene/position.hpp"
#include "renderer/scene/scene_keys.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/model_shape.hpp"
#include "renderer/world/kinematics.hpp"
#include "renderer/world/motion.hpp"
#include "renderer/world/own_light.hpp"
#include "renderer/world/surface_textures_maker.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::renderer {
namespace {

std::string name_of(const scene::Body& body) {
    return fmt::format("body '{}'", body.name);
}

/// One number for each band, or none at all.
void validate_bands(const std::vector<double>& values, std::size_t bands, const std::string& what) {
    if (!values.empty() && values.size() != bands)
        throw ConfigError(
            fmt::format("{}: {} numbers: one for each of the {} bands", what, values.size(), bands));
}

/// Unlike scene files, accepts any positive focal length: a program may place the camera at any distance.
void validate_camera(scene::Camera camera) {
    config::Keys keys = scene::keys_of(camera);
    const auto free = std::find_if(keys.begin(), keys.end(),
                                   [](const config::Key& key) { return key.name == "focal_length_mm"; });
    if (free != keys.end()) keys.erase(free);
    scene::check_ranges(keys, "camera");
    if (!(camera.focal_length_m > 0 && std::isfinite(camera.focal_length_m)))
        throw ConfigError(
            fmt::format("camera: focal length {} m: allowed are positive numbers", camera.focal_length_m));
    if (const std::string why = explain_invalid_row_pitch(camera.pixel_pitch_m, camera.pixel_pitch_y_m);
        !why.empty())
        throw ConfigError("camera: pixel_pitch_y_um: " + why);
}

/// Checks the numbers of a struct of a scene by the ranges of its keys in scene files.
template<typename Struct>
void validate_ranges(Struct values, const std::string& place) {
    scene::check_ranges(scene::keys_of(values), place);
}

void validate_aim(const scene::Scene& scene, const scene::Motion& motion, const std::string& place) {
    if (const std::string why = scene::explain_missing_target(scene, motion); !why.empty())
        throw ConfigError(fmt::format("{}: look_at: {}", place, why));
}

} // namespace

void validate(const scene::Scene& scene) {
    const scene::Camera& c = scene.camera;
    validate_ranges(scene, "scene");
    scene::at_position(c.position, [&] {
        validate_camera(c);
        validate(c.motion, "camera");
        (void)scene::parent_of(scene.bodies, c.parent, c.joint, "camera");
        validate_aim(scene, c.motion, "camera");
    });
    validate_ranges(scene.sun, "sun");
    if (scene.bands.empty()) throw ConfigError("bands: none: at least one spectral band is wanted");
    if (scene.bands.size() > scene::max_bands)
        throw ConfigError(fmt::format("bands: {}: allowed 1 to {}", scene.bands.size(), scene::max_bands));
    for (std::size_t i = 0; i < scene.bands.size(); ++i) {
        const SpectralBand& band = scene.bands[i];
        validate_ranges(band, fmt::format("band {}", i + 1));
        if (!(band.to_m > band.from_m))
            throw ConfigError(fmt::format("bands: band {} from {} to {} m: allowed is from < to", i + 1,
                                          band.from_m, band.to_m));
        const auto& curve = band.transmission;
        for (std::size_t k = 0; k < curve.size(); ++k)
            if (!(std::isfinite(curve[k].wavelength_m) &&
                  (k == 0 || curve[k].wavelength_m > curve[k - 1].wavelength_m)))
                throw ConfigError(fmt::format(
                    "bands: transmission of band {}: point {}: allowed are increasing wavelengths", i + 1,
                    k + 1));
    }
    if (!(length(c.velocity_m_s) < 2.99e8))
        throw ConfigError("camera: the velocity must be less than that of light");
    (void)scene::parents_of(scene);
    for (const scene::Body& body : scene.bodies)
        scene::at_position(body.position, [&] {
            validate(body.motion, name_of(body));
            validate_ranges(body, name_of(body));
            validate_bands(body.colour, scene.bands.size(), name_of(body) + ": colour");
            validate_bands(body.emission_w_m2_sr, scene.bands.size(), name_of(body) + ": emission");
        });
    for (const scene::Lamp& lamp : scene.lamps)
        scene::at_position(lamp.position, [&] {
            const std::string place = fmt::format("lamp '{}'", lamp.name);
            validate(lamp.motion, place);
            validate_ranges(lamp, place);
            (void)scene::parent_of(scene.bodies, lamp.parent, lamp.joint, place);
            validate_aim(scene, lamp.motion, place);
            validate_bands(lamp.intensity_w_sr, scene.bands.size(), place + ": intensity");
        });
    for (const scene::StrayLight& stray : scene.stray_light)
        scene::at_position(stray.position, [&] { validate_ranges(stray, "stray light"); });
}

std::vector<BuiltBody> build_bodies(const scene::Scene& scene, ShapeCache* cache) {
    ShapeContext shapes;
    SurfaceTexturesMaker texture_maker(scene.bands, scene.globals);
    const std::vector<std::int32_t> parents = scene::parents_of(scene);
    std::vector<BuiltBody> built;
    std::vector<WantedShape> wanted;
    std::vector<scene::Shape> shapes_with_globals;
    shapes_with_globals.reserve(scene.bodies.size()); // `wanted` points at them
    std::vector<scene::Material> laws;
    std::vector<OwnLight> lights;
    for (const scene::Body& body : scene.bodies)
        scene::at_position(body.position, [&] {
            scene::Material& law = laws.emplace_back(body.material);
            if (auto* const model = law.get_if<ModelMaterialParameters>()) {
                model->bands = scene.bands.size();
                models::apply_globals(scene.globals, *model);
            }
            (void)make_material(law, name_of(body));
            lights.push_back(own_light(body, law, scene.bands.size()));
            scene::Shape& shape = shapes_with_globals.emplace_back(body.shape);
            if (auto* const model = shape.get_if<ModelShapeParameters>())
                models::apply_globals(scene.globals, *model);
            wanted.push_back({&shape, is_area_light(lights.back())});
        });
    if (cache != nullptr) cache->begin_scene(wanted);
    std::uint32_t materials = 1;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const scene::Body& body = scene.bodies[i];
        scene::at_position(body.position, [&] {
            shapes.place = name_of(body);
            shapes.emits = is_area_light(lights[i]);
            const scene::Shape& described = shapes_with_globals[i];
            auto shape = cache != nullptr ? cache->get(described, shapes) : make_shape(described, shapes);
            scene::Material material_at_mean = laws[i];
            auto textures = texture_maker.make(body, *shape, lights[i], material_at_mean);
            check_model_material(scene, body, material_at_mean, name_of(body));
            auto material = make_material(material_at_mean, name_of(body));
            const auto slots = static_cast<std::uint32_t>(textures ? textures->slots() : 1);
            built.push_back({std::move(shape), std::move(material), body.motion, body.colour,
                             lights[i].radiance_w_m2_sr, std::move(textures), parents[i], body.joint,
                             materials, nullptr});
            materials += slots;
        });
    }
    if (scene.sun.irradiance_scale == 0) return built;
    scene::Motion sun_motion;
    sun_motion.samples[0].pose.position_m = scene.sun.position_m;
    sun_motion.path = scene.sun.path;
    const double r = scene.sun.radius_m;
    built.push_back({std::make_shared<Ellipsoid>(EllipsoidParameters{{r, r, r}}),
                     nullptr,
                     sun_motion,
                     {},
                     {},
                     {},
                     -1,
                     {},
                     materials,
                     nullptr});
    return built;
}

void guide_bounces(std::vector<BuiltBody>& bodies) {
    const bool alone = std::count_if(bodies.begin(), bodies.end(),
                                     [](const BuiltBody& body) { return body.material != nullptr; }) == 1;
    for (BuiltBody& body : bodies) {
        if (!body.material || !body.material->cosine_weighted() || !body.shape->shadows_itself()) continue;
        auto guide = std::make_shared<ElevationGuide>(*body.shape, alone);
        if (guide->guides()) body.guide = std::move(guide);
    }
}

std::vector<AreaLight> area_lights_of(const std::vector<BuiltBody>& bodies) {
    std::vector<AreaLight> lights;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const double area_m2 = bodies[b].shape->sampled_area_m2();
        if (!bodies[b].emission.empty() && area_m2 > 0)
            lights.push_back({static_cast<std::int32_t>(b), area_m2});
    }
    return lights;
}

} // namespace obscura::renderer
