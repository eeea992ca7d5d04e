// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/surface_textures_maker.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/text/suggestion.hpp"
#include "core/units.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/materials/file_materials.hpp"
#include "renderer/materials/model_material.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/shapes/disc.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "renderer/textures/band_weights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace obscura::renderer {
namespace {

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

/// Index of a parameter of a model that is a texture; npos: there is none of that name.
std::size_t texture_parameter(const models::Model& model, std::string_view name) {
    const auto& all = model.parameters();
    const auto found = std::find_if(all.begin(), all.end(), [&](const models::Parameter& p) {
        return p.name == name && p.type == models::Type::texture;
    });
    return found == all.end() ? std::string_view::npos : static_cast<std::size_t>(found - all.begin());
}

std::size_t texture_parameter(const scene::Material& material, std::string_view name) {
    const auto* const law = material.get_if<ModelMaterialParameters>();
    if (law == nullptr || law->loaded == nullptr) return std::string_view::npos;
    return texture_parameter(*law->loaded->model, name);
}

} // namespace

std::shared_ptr<const SurfaceTextures> SurfaceTexturesMaker::make(const scene::Body& body, const Shape& shape,
                                                                  const OwnLight& light,
                                                                  scene::Material& material) {
    const auto* mesh = dynamic_cast<const MeshShape*>(&shape);
    const bool own_uv = mesh != nullptr && !mesh->mesh().uvs.empty() && !body.textures.by_longitude;
    const bool has_uv =
        !body.textures.by_longitude && (own_uv || dynamic_cast<const Disc*>(&shape) != nullptr);
    const Reading reading{has_uv                                              ? TextureMapping::own
                          : body.shape.get_if<TerrainParameters>() != nullptr ? TextureMapping::plane
                                                                              : TextureMapping::longitude,
                          body.textures.srgb ? TextureCoding::srgb : TextureCoding::linear,
                          fmt::format("body '{}'", body.name), shape.bounding_radius_m()};
    const std::shared_ptr<const NestedAlbedo> nested = albedos_.make(body.shape);
    const std::shared_ptr<const ModelSurface> model = model_surface(body, material, reading);
    std::vector<SurfaceTextures::Slot> slots;
    if (body.material.get_if<FileMaterialsParameters>() != nullptr) {
        const auto* file = body.shape.get_if<MeshFileParameters>();
        if (file == nullptr || mesh == nullptr)
            throw ConfigError(fmt::format("{}: only a mesh file can bring its own materials", reading.place));
        if (mesh->mesh().materials.empty())
            throw ConfigError(
                fmt::format("{}: {} brings no materials: the body needs one", reading.place, file->path));
        if (body.textures.has_albedo() || !body.textures.normal.empty() || !body.textures.parameters.empty())
            throw ConfigError(
                fmt::format("{}: textures cannot stand beside the materials of its file", reading.place));
        for (const MeshMaterial& m : mesh->mesh().materials)
            slots.push_back(slot_of(file->path, m, own_uv, reading));
    } else {
        if (!body.textures.has_albedo() && body.textures.normal.empty() && body.textures.parameters.empty() &&
            !body.textures.has_emission() && !nested && !model && !light.law)
            return nullptr;
        SurfaceTextures::Slot slot;
        if (!body.textures.albedo.empty())
            slot.albedo = colours(body.textures.albedo, reading.coding, reading);
        if (!body.textures.normal.empty()) slot.normal = normal(body.textures.normal, reading);
        slots.push_back(std::move(slot));
    }
    auto textures = std::make_shared<SurfaceTextures>(std::move(slots), bands_, body.textures.by_longitude,
                                                      body.textures.left_longitude_rad);
    if (nested) textures->set_nested(nested);
    if (body.textures.albedo_model) {
        auto albedo = procedural(*body.textures.albedo_model, Use::bands, reading);
        const ProceduralTexture::Range range =
            checked_range(*albedo, "albedo_texture", reading, textures.get());
        textures->set_albedo_model(std::move(albedo), range.mean);
    }
    if (!body.textures.parameters.empty() || model) set_maps(body, reading, material, *textures);
    if (model) textures->set_model(model);
    if (light.law)
        textures->set_model_emission(
            std::make_shared<ModelSurface>(light.law, images_of(body, material, reading)),
            body.emission_w_m2_sr);
    if (body.textures.has_emission() && body.emission_w_m2_sr.empty())
        throw ConfigError(fmt::format("{}: an emission texture is a factor on the emission, which is missing",
                                      reading.place));
    if (!body.textures.emission.empty())
        textures->set_emission(colours(body.textures.emission, reading.coding, reading));
    if (body.textures.emission_model) {
        auto emission = procedural(*body.textures.emission_model, Use::bands, reading);
        (void)checked_range(*emission, "emission_texture", reading, textures.get());
        textures->set_emission_model(std::move(emission));
    }
    note_places(body.textures, reading.mapping, *textures);
    return textures;
}

/// Says where the maps of a body are by their own georeference.
void SurfaceTexturesMaker::note_places(const scene::Textures& given, TextureMapping mapping,
                                       SurfaceTextures& textures) {
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
                fmt::format("{}: a map of {:.3g} % of the body: elsewhere its texture changes nothing", file,
                            100 * place->share()));
    }
}

/// Images of the textures that a law of a user's own has as parameters. Sets those to their means.
std::vector<ModelImage> SurfaceTexturesMaker::images_of(const scene::Body& body, scene::Material& material,
                                                        const Reading& reading) {
    auto& law = material.get<ModelMaterialParameters>();
    std::vector<ModelImage> images(law.loaded->model->parameters().size());
    for (const scene::Textures::Parameter& map : body.textures.parameters) {
        const std::size_t index = texture_parameter(material, map.name);
        if (index >= images.size()) continue;
        ModelImage& image = images[index];
        image.at_zero = map.at_zero;
        image.gain = map.at_one - map.at_zero;
        if (map.model)
            image.model = procedural(*map.model, Use::channels, reading);
        else
            image.texture = cache_.get(map.file, TextureCoding::linear, reading.mapping);
        law.values[index] = mean_channels(image);
    }
    return images;
}

/// What the law of the body reads at the points that are hit; null: nothing, or it is built in.
std::shared_ptr<const ModelSurface> SurfaceTexturesMaker::model_surface(const scene::Body& body,
                                                                        scene::Material& material,
                                                                        const Reading& reading) {
    if (material.get_if<ModelMaterialParameters>() == nullptr) return nullptr;
    std::vector<ModelImage> images = images_of(body, material, reading);
    auto law = varied_law(material.get<ModelMaterialParameters>());
    for (const models::LookUp& read : law->reads())
        if (!images[read.texture])
            throw ConfigError(fmt::format("{}: {}: the image of the texture \"{}\" is missing", reading.place,
                                          law->model().name(), law->model().parameters()[read.texture].name));
    if (!law->differs_by_point()) return nullptr;
    return std::make_shared<ModelSurface>(std::move(law), std::move(images));
}

std::shared_ptr<const ProceduralTexture> SurfaceTexturesMaker::procedural(const scene::ModelTexture& given,
                                                                          Use use, const Reading& reading) {
    scene::ModelTexture texture = given;
    models::apply_globals(globals_, texture);
    const models::Model& model = *texture.loaded->model;
    models::TextureParameters parameters{models::program_parameters(texture)};
    parameters.bands = use == Use::bands ? bands_.size() : use == Use::channels ? 4 : 1;
    if (const std::string why = models::explain_channels(texture, parameters.bands); !why.empty())
        throw ConfigError(fmt::format("{}: {}: {}", reading.place, model.name(), why));
    const std::size_t own = model.parameters().size();
    std::vector<ProceduralTexture::Image> images(own + 1);
    parameters.images.resize(own + 1);
    for (const scene::ModelTexture::Image& image : texture.images) {
        const bool is_own = image.name == scene::ModelTexture::own_image &&
                            texture_parameter(model, image.name) == std::string_view::npos;
        const std::size_t index = is_own ? own : texture_parameter(model, image.name);
        ProceduralTexture::Image& read = images[index];
        if (use == Use::bands) {
            read.texture = colours(image.file, reading.coding, reading).texture;
            read.weights = band_weights(*read.texture, bands_);
        } else {
            read.texture = cache_.get(image.file, TextureCoding::linear, reading.mapping).texture;
        }
        const std::size_t planes = read.texture->planes();
        parameters.images[index] = {read.texture->width(), read.texture->height(),
                                    read.weights.empty() ? planes == 1
                                                         : same_in_all_bands(read.weights, planes)};
    }
    return std::make_shared<ProceduralTexture>(
        std::make_shared<models::TextureProgram>(texture.loaded->model, parameters), std::move(images));
}

ProceduralTexture::Range SurfaceTexturesMaker::checked_range(const ProceduralTexture& texture,
                                                             std::string_view what, const Reading& reading,
                                                             SurfaceTextures* notes) {
    const ProceduralTexture::Range range = texture.range(reading.radius_m);
    const std::string name = fmt::format("{}: {}: {}", reading.place, what, texture.program().model().name());
    if (range.no_data_share == 1) throw ConfigError(name + ": gives no data anywhere");
    if (range.infinite_share > 0)
        throw ConfigError(fmt::format("{}: is not finite for {:.1f} % of the texture, {}", name,
                                      std::max(0.1, 100 * range.infinite_share), range.infinite_at));
    if (notes == nullptr) return range;
    if (range.no_data_share > 0)
        notes->add_note(fmt::format("{}: no data for {:.1f} %: it changes nothing there", name,
                                    std::max(0.1, 100 * range.no_data_share)));
    if (range.negative_share > 0)
        notes->add_note(fmt::format("{}: negative for {:.1f} %, most {}: counts as 0 there", name,
                                    std::max(0.1, 100 * range.negative_share), range.negative_at));
    if (what == "albedo_texture" && range.largest > 1)
        notes->add_note(
            fmt::format("{}: up to {:.4g}, {}: more than all light", name, range.largest, range.largest_at));
    return range;
}

void SurfaceTexturesMaker::set_maps(const scene::Body& body, const Reading& reading,
                                    scene::Material& material, SurfaceTextures& textures) {
    const std::vector<VaryingParameter> parameters = varying_parameters(material);
    std::vector<SurfaceTextures::Map> maps;
    scene::Material least = material;
    scene::Material most = material;
    for (const scene::Textures::Parameter& map : body.textures.parameters) {
        if (texture_parameter(material, map.name) != std::string_view::npos) continue;
        const auto found = std::find_if(parameters.begin(), parameters.end(),
                                        [&](const VaryingParameter& p) { return p.name == map.name; });
        if (found == parameters.end()) {
            std::vector<std::string_view> names{"albedo"};
            for (const VaryingParameter& p : parameters)
                names.push_back(p.name);
            throw ConfigError(fmt::format("{}: no texture can give its material's {}: {}", reading.place,
                                          map.name, allowed_words(map.name, names)));
        }
        const auto index = static_cast<std::size_t>(found - parameters.begin());
        SurfaceTextures::Map made{index, {}, map.at_zero, map.at_one - map.at_zero};
        ProceduralTexture::Range range;
        if (map.model) {
            made.model = procedural(*map.model, Use::parameter, reading);
            range = checked_range(*made.model, map.name, reading, nullptr);
        } else {
            made.texture = cache_.get(map.file, TextureCoding::linear, reading.mapping);
            const Texture* const texture = made.texture.texture.get();
            if (texture->planes() != 1)
                throw InputError(fmt::format("{}: {} planes: the {} of {} needs 1", map.file,
                                             texture->planes(), map.name, reading.place));
            range.least = texture->least(0);
            range.largest = texture->largest(0);
            range.mean = texture->mean(0);
            range.no_data_share = made.texture.place ? 1 - made.texture.place->share() : 0;
        }
        const double a = map.at_zero + made.gain * range.least;
        const double b = map.at_zero + made.gain * range.largest;
        // The slack keeps a limit that is met exactly from failing by rounding.
        const double slack = 1e-12 * std::abs(made.gain);
        set_varying_parameter(least, index, std::min(a, b) + slack);
        set_varying_parameter(most, index, std::max(a, b) - slack);
        // Outside the map, the material's own number.
        const double own = parameters[index].value;
        const double share = 1 - range.no_data_share;
        set_varying_parameter(material, index,
                              share * (map.at_zero + made.gain * range.mean) + (1 - share) * own);
        maps.push_back(std::move(made));
    }
    // Check the law's rules at the extremes of the texels.
    (void)make_material(least, reading.place + ", least texels of its parameters");
    (void)make_material(most, reading.place + ", largest texels of its parameters");
    std::vector<double> constants;
    for (const VaryingParameter& p : parameters)
        constants.push_back(p.value);
    textures.set_maps(std::move(maps), std::move(constants));
}

SurfaceTextures::Slot SurfaceTexturesMaker::slot_of(const std::filesystem::path& file, const MeshMaterial& m,
                                                    bool own_uv, const Reading& reading) {
    SurfaceTextures::Slot slot;
    std::array<float, 3> rgb = m.diffuse;
    const auto path = [&](const std::filesystem::path& word) {
        if (word.string().starts_with("*"))
            throw InputError(
                fmt::format("{}: material '{}' has its texture inside the file: it must be a file of its own",
                            file.string(), m.name));
        return find_texture(file, word.string());
    };
    // Textures need texture coordinates.
    if (own_uv && !m.albedo_texture.empty()) {
        slot.albedo = colours(path(m.albedo_texture), TextureCoding::srgb, reading);
        // Some writers leave the colour black under a texture.
        if (rgb == std::array<float, 3>{0, 0, 0}) rgb = {1, 1, 1};
    }
    if (own_uv && !m.normal_texture.empty()) slot.normal = normal(path(m.normal_texture), reading);
    for (const SpectralBand& band : bands_) {
        const std::array<double, 3> shares = colour_shares(band);
        double value = 0;
        for (std::size_t k = 0; k < 3; ++k)
            value += shares[k] * static_cast<double>(rgb[k]);
        slot.factor.push_back(value);
    }
    return slot;
}

PlacedTexture SurfaceTexturesMaker::colours(const std::filesystem::path& file, TextureCoding coding,
                                            const Reading& reading) {
    PlacedTexture placed = cache_.get(file, coding, reading.mapping);
    const Texture* const texture = placed.texture.get();
    if (texture->planes() != 1 && !texture->rgb() && texture->planes() != bands_.size())
        throw InputError(fmt::format(
            "{}: {} planes: allowed for {} are 1, red, green and blue, or one for each of the {} bands",
            file.string(), texture->planes(), reading.place, bands_.size()));
    return placed;
}

PlacedTexture SurfaceTexturesMaker::normal(const std::filesystem::path& file, const Reading& reading) {
    PlacedTexture texture = cache_.get(file, TextureCoding::linear, reading.mapping);
    if (texture.texture->planes() != 3)
        throw InputError(fmt::format("{}: {} planes: the normal map of {} needs 3", file.string(),
                                     texture.texture->planes(), reading.place));
    return texture;
}

} // namespace obscura::renderer
