// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/model_table.hpp"

#include "models/values/model_table.hpp"
#include "renderer/materials/model_material.hpp"
#include "renderer/scene_files/parameter_texture.hpp"
#include "renderer/shapes/model_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace obscura::scene {
namespace {

/// Keys of the textures of the model, which are files, and of images of other parameters.
struct TextureKeys {
    std::vector<ParameterTexture> textures;
    config::Keys keys;

    TextureKeys(const ParameterList& parameters, const models::Model& model)
        : textures(textures_of(parameters)) {
        for (const models::Parameter& p : model.parameters()) {
            if (p.type != models::Type::texture) continue;
            // The file stands where other parameters have their constant.
            ParameterTexture t;
            t.parameter = t.file_key = p.name;
            t.range_key = t.parameter + "_range";
            t.file_help = p.help.empty() ? "Image of the texture" : std::string(p.help);
            t.range_help = fmt::format(
                "Values for a texel of 0 and a texel of 1 (integers: full scale) of {}", t.file_key);
            textures.push_back(std::move(t));
        }
        keys = texture_keys(textures);
    }
    static bool is_texture(const models::Model& model, std::string_view name) {
        return std::any_of(
            model.parameters().begin(), model.parameters().end(),
            [&](const models::Parameter& p) { return p.name == name && p.type == models::Type::texture; });
    }
};

} // namespace

void read_shape_model(const config::ReadTable& table, Body& body) {
    const bool own = models::read_model_table(
        table, "shape", "shape",
        [&](const config::Member& member, const config::Where& where, std::string& file) {
            renderer::ModelShapeParameters p{models::defaults_of(models::load_model(file, "shape"))};
            config::Keys keys = models::parameter_keys(p, &member.value);
            for (config::Key& key : renderer::ellipsoid_keys(p))
                keys.push_back(std::move(key));
            keys.push_back(models::model_key(file));
            (void)config::read_keys(member.value, where, keys, table.mistakes());
            body.shape = std::move(p);
        });
    if (!own)
        table.refuse("shape", "a shape of your own has a table: write shape = { model = \"FILE.shp\" }");
}

std::shared_ptr<const ModelTexture> read_texture_model(const config::ReadTable& table, std::string_view key) {
    std::shared_ptr<const ModelTexture> read;
    (void)models::read_model_table(
        table, key, "texture",
        [&](const config::Member& member, const config::Where& where, std::string& file) {
            ModelTexture texture{models::defaults_of(models::load_model(file, "texture"))};
            const auto& parameters = texture.loaded->model->parameters();
            texture.images.push_back({std::string(ModelTexture::own_image), ""});
            for (const models::Parameter& p : parameters)
                if (p.type == models::Type::texture && p.name != ModelTexture::own_image)
                    texture.images.push_back({std::string(p.name), ""});
            config::Keys keys{models::model_key(file)};
            for (ModelTexture::Image& image : texture.images)
                keys.push_back(config::key(image.name, config::Path{&image.file, true, true})
                                   .help("Image that the texture reads"));
            for (std::size_t i = 0; i < parameters.size(); ++i)
                if (!parameters[i].global && parameters[i].type != models::Type::texture)
                    keys.push_back(models::parameter_key(texture, i, &member.value));
            (void)config::read_keys(member.value, where, keys, table.mistakes());
            std::erase_if(texture.images,
                          [](const ModelTexture::Image& image) { return image.file.empty(); });
            read = std::make_shared<ModelTexture>(std::move(texture));
        });
    return read;
}

void read_material_model(const config::ReadTable& table, Body& body) {
    const bool own = models::read_model_table(
        table, "material", "material",
        [&](const config::Member& member, const config::Where& where, std::string& file) {
            renderer::ModelMaterialParameters p = renderer::load_material_model(file);
            const models::Model& model = *p.loaded->model;
            const ParameterList parameters = declare(p, &member.value);
            TextureKeys images(parameters, model);
            config::Keys keys{models::model_key(file)};
            for (const Parameter& parameter : parameters)
                keys.push_back(parameter.key);
            keys.insert(keys.end(), images.keys.begin(), images.keys.end());
            const config::Given given = config::read_keys(member.value, where, keys, table.mistakes());
            const config::ReadTable read(&member.value, member.at, where, given, table.mistakes());
            add_parameter_textures(images.textures, body.textures, read);
            for (const ParameterTexture& t : images.textures)
                if (TextureKeys::is_texture(model, t.parameter) && !read.has(t.file_key))
                    read.refuse_table("the image of the model's texture \"" + t.parameter + "\" is missing");
            body.material = std::move(p);
        });
    if (!own)
        table.refuse("material", "a law of your own has a table: write material = { model = \"FILE.brdf\" }");
}

} // namespace obscura::scene
