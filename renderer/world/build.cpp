// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/build.hpp"

#include "core/camera/pixel_pitch.hpp"
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "models/kinds/material_checks.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/materials/file_materials.hpp"
#include "renderer/materials/model_material.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/registries/registry.hpp"
#include "renderer/registries/shape_cache.hpp"
#include "renderer/scene/position.hpp"
#include "renderer/scene/scene_keys.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/shapes/disc.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "renderer/textures/surface_textures.hpp"
#include "renderer/world/albedo_maker.hpp"
#include "renderer/world/kinematics.hpp"
#include "renderer/world/motion.hpp"

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

/// Resolves the texture path `word` of a mesh file, with either kind of slash: relative to the file's folder,
/// or by name in that folder or in a folder "textures" beside.
std::filesystem::path find_texture(const std::filesystem::path& mesh, const std::string& word) {
    std::string path = word;
    std::replace(path.begin(), path.end(), '\\', '/');
    const std::filesystem::path folder = mesh.parent_path();
    const std::filesystem::path name = std::filesystem::path(path).filename();
    for (const std::filesystem::path& at : {folder / path, folder / name, folder / "textures" / name}) {
        if (is_file_at(at)) return at;
    }
    return folder / path;
}

/// Light that a body emits by itself.
struct OwnLight {
    std::vector<double> radiance_w_m2_sr; ///< in each band, of which textures give a factor; empty: none
    /// emission() of the body's law where it varies: the factor on `radiance_w_m2_sr`, which is 1.
    std::shared_ptr<const models::MaterialProgram> law;
    bool uniform = true; ///< over the body, and in all directions
};

OwnLight own_light(const scene::Body& body, const scene::Material& material, std::size_t bands) {
    const bool mapped = !body.textures.emission.empty();
    OwnLight light{body.emission_w_m2_sr, nullptr, !mapped};
    const auto* const model = material.get_if<ModelMaterialParameters>();
    if (model == nullptr) return light;
    light.law = law_emission(*model, body.emission_w_m2_sr, mapped && !body.emission_w_m2_sr.empty());
    if (light.law == nullptr) return light;
    const models::EmissionReport report =
        models::report_on_emission(*light.law, std::vector<double>(light.law->rows(), 0.5));
    if (const std::string why = models::refusal_by(report); !why.empty())
        throw ConfigError(fmt::format("{}: {}: {}", name_of(body), light.law->model().name(), why));
    if (!light.law->is_constant()) {
        light.uniform = false;
        light.radiance_w_m2_sr.assign(bands, 1);
        return light;
    }
    light.radiance_w_m2_sr = constant_emission(*light.law, bands);
    for (const double value : light.radiance_w_m2_sr)
        if (!(value >= 0 && value <= 1e15))
            throw ConfigError(fmt::format("{}: {}: emission() is {}: allowed is 0 to 1e15 W m-2 sr-1",
                                          name_of(body), light.law->model().name(), value));
    if (std::all_of(light.radiance_w_m2_sr.begin(), light.radiance_w_m2_sr.end(),
                    [](double value) { return value == 0; }))
        light.radiance_w_m2_sr.clear();
    light.uniform = true;
    light.law = nullptr;
    return light;
}

/// An area light is uniform; other light is found by the paths that hit it.
bool is_area_light(const OwnLight& light) {
    return !light.radiance_w_m2_sr.empty() && light.uniform;
}

/// Makes the surface textures of bodies; those that name the same file share one texture.
class SurfaceTexturesMaker {
public:
    explicit SurfaceTexturesMaker(const std::vector<SpectralBand>& bands) : bands_(bands), albedos_(bands) {}

    /// Null where nothing varies over the body. Sets the textured parameters of `material` to their means.
    std::shared_ptr<const SurfaceTextures> make(const scene::Body& body, const Shape& shape,
                                                const OwnLight& light, scene::Material& material) {
        const std::string place = name_of(body);
        const auto* mesh = dynamic_cast<const MeshShape*>(&shape);
        const bool own_uv = mesh != nullptr && !mesh->mesh().uvs.empty() && !body.textures.by_longitude;
        const bool has_uv =
            !body.textures.by_longitude && (own_uv || dynamic_cast<const Disc*>(&shape) != nullptr);
        const TextureMapping mapping = has_uv ? TextureMapping::own
                                       : body.shape.get_if<TerrainParameters>() != nullptr
                                           ? TextureMapping::plane
                                           : TextureMapping::longitude;
        const TextureCoding coding = body.textures.srgb ? TextureCoding::srgb : TextureCoding::linear;
        const std::shared_ptr<const NestedAlbedo> nested = albedos_.make(body.shape);
        const std::shared_ptr<const ModelSurface> model = model_surface(body, material, mapping, place);
        std::vector<SurfaceTextures::Slot> slots;
        if (body.material.get_if<FileMaterialsParameters>() != nullptr) {
            const auto* file = body.shape.get_if<MeshFileParameters>();
            if (file == nullptr || mesh == nullptr)
                throw ConfigError(fmt::format("{}: only a mesh file can bring its own materials", place));
            if (mesh->mesh().materials.empty())
                throw ConfigError(
                    fmt::format("{}: {} brings no materials: the body needs one", place, file->path));
            if (!body.textures.albedo.empty() || !body.textures.normal.empty() ||
                !body.textures.parameters.empty())
                throw ConfigError(
                    fmt::format("{}: textures cannot stand beside the materials of its file", place));
            for (const MeshMaterial& m : mesh->mesh().materials)
                slots.push_back(slot_of(file->path, m, own_uv, mapping, place));
        } else {
            if (body.textures.albedo.empty() && body.textures.normal.empty() &&
                body.textures.parameters.empty() && body.textures.emission.empty() && !nested && !model &&
                !light.law)
                return nullptr;
            SurfaceTextures::Slot slot;
            if (!body.textures.albedo.empty())
                slot.albedo = colours(body.textures.albedo, coding, mapping, place);
            if (!body.textures.normal.empty()) slot.normal = normal(body.textures.normal, mapping, place);
            slots.push_back(std::move(slot));
        }
        auto textures = std::make_shared<SurfaceTextures>(
            std::move(slots), bands_, body.textures.by_longitude, body.textures.left_longitude_rad);
        if (nested) textures->set_nested(nested);
        if (!body.textures.parameters.empty() || model)
            set_maps(body.textures.parameters, mapping, place, material, *textures);
        if (model) textures->set_model(model);
        if (light.law)
            textures->set_model_emission(
                std::make_shared<ModelSurface>(light.law, images_of(body, material, mapping)),
                body.emission_w_m2_sr);
        if (!body.textures.emission.empty()) {
            if (body.emission_w_m2_sr.empty())
                throw ConfigError(fmt::format(
                    "{}: an emission texture is a factor on the emission, which is missing", place));
            textures->set_emission(colours(body.textures.emission, coding, mapping, place));
        }
        note_places(body.textures, mapping, *textures);
        return textures;
    }

private:
    /// Says where the maps of a body are by their own georeference.
    void note_places(const scene::Textures& given, TextureMapping mapping, SurfaceTextures& textures) {
        std::vector<std::string> files{given.albedo, given.normal, given.emission};
        for (const scene::Textures::Parameter& map : given.parameters)
            files.push_back(map.file);
        std::sort(files.begin(), files.end());
        files.erase(std::unique(files.begin(), files.end()), files.end());
        for (const std::string& file : files) {
            const TexturePlace* const place = file.empty() ? nullptr : cache_.place(file, mapping);
            if (place == nullptr) continue;
            if (given.left_longitude_rad != scene::Textures().left_longitude_rad)
                textures.add_note(
                    fmt::format("{}: placed by its own georeference, not by texture_left_deg", file));
            if (place->share() < 1)
                textures.add_note(
                    fmt::format("{}: a map of {:.3g} % of the body: elsewhere its texture changes nothing",
                                file, 100 * place->share()));
        }
    }

    /// Images of the textures that a law of a user's own has as parameters. Sets those to their means.
    std::vector<ModelImage> images_of(const scene::Body& body, scene::Material& material,
                                      TextureMapping mapping) {
        auto& law = material.get<ModelMaterialParameters>();
        std::vector<ModelImage> images(law.loaded->model->parameters().size());
        for (const scene::Textures::Parameter& map : body.textures.parameters) {
            const std::size_t index = texture_parameter(material, map.name);
            if (index >= images.size()) continue;
            images[index] = {cache_.get(map.file, TextureCoding::linear, mapping), map.at_zero,
                             map.at_one - map.at_zero};
            law.values[index] = mean_channels(images[index]);
        }
        return images;
    }

    /// Index of a parameter of a model that is a texture; beyond all: there is none of that name.
    static std::size_t texture_parameter(const scene::Material& material, std::string_view name) {
        const auto* const law = material.get_if<ModelMaterialParameters>();
        if (law == nullptr || law->loaded == nullptr) return std::string_view::npos;
        const auto& all = law->loaded->model->parameters();
        const auto found = std::find_if(all.begin(), all.end(), [&](const models::Parameter& p) {
            return p.name == name && p.type == models::Type::texture;
        });
        return found == all.end() ? std::string_view::npos : static_cast<std::size_t>(found - all.begin());
    }

    /// What the law of the body reads at the points that are hit; null: nothing, or it is built in.
    std::shared_ptr<const ModelSurface> model_surface(const scene::Body& body, scene::Material& material,
                                                      TextureMapping mapping, const std::string& place) {
        if (material.get_if<ModelMaterialParameters>() == nullptr) return nullptr;
        std::vector<ModelImage> images = images_of(body, material, mapping);
        auto law = varied_law(material.get<ModelMaterialParameters>());
        for (const models::LookUp& read : law->reads())
            if (!images[read.texture].texture)
                throw ConfigError(fmt::format("{}: {}: the image of the texture \"{}\" is missing", place,
                                              law->model().name(),
                                              law->model().parameters()[read.texture].name));
        if (!law->differs_by_point()) return nullptr;
        return std::make_shared<ModelSurface>(std::move(law), std::move(images));
    }

    void set_maps(const std::vector<scene::Textures::Parameter>& given, TextureMapping mapping,
                  const std::string& place, scene::Material& material, SurfaceTextures& textures) {
        const std::vector<VaryingParameter> parameters = varying_parameters(material);
        std::vector<SurfaceTextures::Map> maps;
        scene::Material least = material;
        scene::Material most = material;
        for (const scene::Textures::Parameter& map : given) {
            if (texture_parameter(material, map.name) != std::string_view::npos) continue;
            const auto found = std::find_if(parameters.begin(), parameters.end(),
                                            [&](const VaryingParameter& p) { return p.name == map.name; });
            if (found == parameters.end()) {
                std::vector<std::string_view> names;
                for (const VaryingParameter& p : parameters)
                    names.push_back(p.name);
                throw ConfigError(
                    fmt::format("{}: no texture can give its material's {}: allowed are albedo{}{}", place,
                                map.name, names.empty() ? "" : ", ", fmt::join(names, ", ")));
            }
            const auto index = static_cast<std::size_t>(found - parameters.begin());
            PlacedTexture placed = cache_.get(map.file, TextureCoding::linear, mapping);
            const Texture* const texture = placed.texture.get();
            if (texture->planes() != 1)
                throw InputError(fmt::format("{}: {} planes: the {} of {} needs 1", map.file,
                                             texture->planes(), map.name, place));
            const double gain = map.at_one - map.at_zero;
            const double a = map.at_zero + gain * texture->least(0);
            const double b = map.at_zero + gain * texture->largest(0);
            // The slack keeps a limit that is met exactly from failing by rounding.
            const double slack = 1e-12 * std::abs(gain);
            set_varying_parameter(least, index, std::min(a, b) + slack);
            set_varying_parameter(most, index, std::max(a, b) - slack);
            // Outside the map, the material's own number.
            const double own = parameters[index].value;
            const double share = placed.place ? placed.place->share() : 1;
            set_varying_parameter(material, index,
                                  share * (map.at_zero + gain * texture->mean(0)) + (1 - share) * own);
            maps.push_back({index, std::move(placed), map.at_zero, gain});
        }
        // Check the law's rules at the extremes of the texels.
        (void)make_material(least, place + ", least texels of its parameters");
        (void)make_material(most, place + ", largest texels of its parameters");
        std::vector<double> constants;
        for (const VaryingParameter& p : parameters)
            constants.push_back(p.value);
        textures.set_maps(std::move(maps), std::move(constants));
    }

    SurfaceTextures::Slot slot_of(const std::filesystem::path& file, const MeshMaterial& m, bool own_uv,
                                  TextureMapping mapping, const std::string& place) {
        SurfaceTextures::Slot slot;
        std::array<float, 3> rgb = m.diffuse;
        const auto path = [&](const std::filesystem::path& word) {
            if (word.string().starts_with("*"))
                throw InputError(fmt::format(
                    "{}: material '{}' has its texture inside the file: it must be a file of its own",
                    file.string(), m.name));
            return find_texture(file, word.string());
        };
        // Textures need texture coordinates.
        if (own_uv && !m.albedo_texture.empty()) {
            slot.albedo = colours(path(m.albedo_texture), TextureCoding::srgb, mapping, place);
            // Some writers leave the colour black under a texture.
            if (rgb == std::array<float, 3>{0, 0, 0}) rgb = {1, 1, 1};
        }
        if (own_uv && !m.normal_texture.empty()) slot.normal = normal(path(m.normal_texture), mapping, place);
        for (const SpectralBand& band : bands_) {
            const std::array<double, 3> shares = colour_shares(band);
            double value = 0;
            for (std::size_t k = 0; k < 3; ++k)
                value += shares[k] * static_cast<double>(rgb[k]);
            slot.factor.push_back(value);
        }
        return slot;
    }

    PlacedTexture colours(const std::filesystem::path& file, TextureCoding coding, TextureMapping mapping,
                          const std::string& place) {
        PlacedTexture placed = cache_.get(file, coding, mapping);
        const Texture* const texture = placed.texture.get();
        if (texture->planes() != 1 && !texture->rgb() && texture->planes() != bands_.size())
            throw InputError(fmt::format(
                "{}: {} planes: allowed for {} are 1, red, green and blue, or one for each of the {} bands",
                file.string(), texture->planes(), place, bands_.size()));
        return placed;
    }
    PlacedTexture normal(const std::filesystem::path& file, TextureMapping mapping,
                         const std::string& place) {
        PlacedTexture texture = cache_.get(file, TextureCoding::linear, mapping);
        if (texture.texture->planes() != 3)
            throw InputError(fmt::format("{}: {} planes: the normal map of {} needs 3", file.string(),
                                         texture.texture->planes(), place));
        return texture;
    }
    const std::vector<SpectralBand>& bands_;
    TextureCache cache_;
    AlbedoMaker albedos_;
};

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
    SurfaceTexturesMaker texture_maker(scene.bands);
    const std::vector<std::int32_t> parents = scene::parents_of(scene);
    std::vector<BuiltBody> built;
    std::vector<WantedShape> wanted;
    std::vector<scene::Material> laws;
    std::vector<OwnLight> lights;
    for (const scene::Body& body : scene.bodies)
        scene::at_position(body.position, [&] {
            scene::Material& law = laws.emplace_back(body.material);
            if (auto* const model = law.get_if<ModelMaterialParameters>()) model->bands = scene.bands.size();
            (void)make_material(law, name_of(body));
            lights.push_back(own_light(body, law, scene.bands.size()));
            wanted.push_back({&body.shape, is_area_light(lights.back())});
        });
    if (cache != nullptr) cache->begin_scene(wanted);
    std::uint32_t materials = 1;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const scene::Body& body = scene.bodies[i];
        scene::at_position(body.position, [&] {
            shapes.place = name_of(body);
            shapes.emits = is_area_light(lights[i]);
            auto shape = cache != nullptr ? cache->get(body.shape, shapes) : make_shape(body.shape, shapes);
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
