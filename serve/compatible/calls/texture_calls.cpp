// SPDX-License-Identifier: Apache-2.0
// Commands of textures whose texels the client sends, or that have a name of their own.
#include "core/text/printable.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/objects.hpp"
#include "serve/compatible/packed_bytes.hpp"
#include "serve/compatible/picture_file.hpp"
#include "serve/compatible/textures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::serve::compatible {
namespace {

constexpr std::int64_t largest_side = 16384;
constexpr std::int64_t max_texels = std::int64_t{1} << 24;

NamedTexture& named_texture(Request& r, std::string_view argument) {
    const std::string& name = r.arguments.text(argument);
    const auto found = r.client_state.textures.find(name);
    if (found == r.client_state.textures.end())
        throw r.arguments.refused(argument, fmt::format("no texture is called \"{}\"", printable(name, 60)),
                                  "one that was created before");
    return found->second;
}

/// Texels as planes. Their type follows from the size: float32 or 8 bits, 1, 3 or 4 values each.
PicturePlanes planes_of(const Request& r, const NamedTexture& texture, const std::string& data) {
    const std::size_t texels =
        static_cast<std::size_t>(texture.width) * static_cast<std::size_t>(texture.height);
    std::size_t values = 0, bytes = 0;
    for (const std::size_t count :
         texture.gray ? std::vector<std::size_t>{1} : std::vector<std::size_t>{4, 3})
        for (const std::size_t size : {sizeof(float), std::size_t{1}})
            if (data.size() == texels * count * size) values = count, bytes = size;
    if (values == 0)
        throw r.arguments.refused(
            "data", fmt::format("{} bytes for {} x {} texels", data.size(), texture.width, texture.height),
            texture.gray ? "1 value for each, float32 or 8 bits"
                         : "3 or 4 values for each, float32 or 8 bits");
    PicturePlanes made{texture.width, texture.height,
                       std::vector<std::vector<float>>(values, std::vector<float>(texels)), ""};
    for (std::size_t i = 0; i < texels * values; ++i) {
        float value = 0;
        if (bytes == 1)
            value = static_cast<float>(static_cast<unsigned char>(data[i])) / 255.0F;
        else
            std::memcpy(&value, data.data() + i * sizeof value, sizeof value);
        if (!(value >= 0 && std::isfinite(value)))
            throw r.arguments.refused("data", "has a value that is negative or not finite",
                                      "values from 0 up");
        made.planes[i % values][i / values] = value;
    }
    return made;
}

/// A new file of the texels, which the objects that wear the texture get too. FITS planes are those of the
/// channels; red, green and blue of OpenEXR go to channels by wavelength.
void put_texels(ClientState& client_state, const std::string& name, NamedTexture& texture,
                const PicturePlanes& planes) {
    const std::string before = texture.file;
    const std::string file = client_state.own.write(planes.planes.size() == 3 ? ".exr" : ".fits", {});
    client_state.own.count(file, planes.planes.size() * planes.planes[0].size() * sizeof(float));
    save_floats(file, planes);
    texture.file = file;
    for (auto& [object_name, object] : client_state.objects)
        for (const auto& [unit, worn] : object.worn_textures)
            if (worn == name) wear(object, unit, texture.file);
    if (texture.own) client_state.own.remove(before);
    texture.own = true;
}

void create(Request& r) {
    NamedTexture texture;
    texture.width = static_cast<std::int32_t>(r.arguments.integer("width", 1, largest_side));
    texture.height = static_cast<std::int32_t>(r.arguments.integer("height", 1, largest_side));
    if (std::int64_t{texture.width} * texture.height > max_texels)
        throw r.arguments.refused("width", fmt::format("{} x {} texels", texture.width, texture.height),
                                  fmt::format("{} in all", max_texels));
    texture.gray = r.arguments.flag("gray");
    NamedTexture& made = put(r.client_state.textures, r.arguments, "name", texture);
    put_texels(r.client_state, r.arguments.text("name"), made, {1, 1, {{1.0F}}, ""}); // white
}

void update(Request& r) {
    NamedTexture& texture = named_texture(r, "name");
    if (texture.width == 0)
        throw r.arguments.refused("name", "is a file", "a texture of createUserDataTexture");
    const std::string& sent = r.arguments.bytes("data");
    const std::size_t most = static_cast<std::size_t>(texture.width) *
                             static_cast<std::size_t>(texture.height) * 4 * sizeof(float);
    // Expanded, and as planes.
    const service::MemoryAccount::Share share = r.client_state.hold(2 * most);
    const bool lz4 = r.arguments.has("use_lz4") && r.arguments.flag("use_lz4");
    const std::string data =
        lz4 ? expand_lz4(
                  sent, static_cast<std::size_t>(r.arguments.integer("size", 0, std::int64_t{1} << 32)), most)
            : inflate_packed(sent, most);
    put_texels(r.client_state, r.arguments.text("name"), texture, planes_of(r, texture, data));
}

/// Name of a picture of a sequence, whose number stands where the name has "%04d" or "%d"; empty: no such
/// place.
std::string numbered(const std::string& sequence, std::int64_t number) {
    const std::size_t at = sequence.find('%'), end = sequence.find('d', std::min(at, sequence.size()));
    if (at == std::string::npos || end == std::string::npos) return {};
    const std::string_view digits = std::string_view(sequence).substr(at + 1, end - at - 1);
    const bool padded = digits.size() == 2 && digits[0] == '0' && digits[1] >= '1' && digits[1] <= '9';
    if (!digits.empty() && !padded) return {};
    return sequence.substr(0, at) + fmt::format("{:0{}}", number, padded ? digits[1] - '0' : 1) +
           sequence.substr(end + 1);
}

/// The file of a picture; empty: there is none.
std::string frame_file(Request& r, const NamedTexture& texture, std::int64_t number) {
    const auto found = r.client_state.files.find(numbered(texture.sequence, number));
    return found ? found->string() : std::string();
}

std::int64_t first_number(Request& r, const NamedTexture& texture) {
    return frame_file(r, texture, 0).empty() ? 1 : 0;
}

void create_video(Request& r) {
    NamedTexture texture;
    texture.sequence = r.arguments.text("filename");
    texture.loop = r.arguments.flag("loop");
    if (numbered(texture.sequence, 0).empty())
        throw r.arguments.refused("filename", "files of videos are not read",
                                  "a sequence of pictures such as film_%04d.png, from number 0 or 1 on");
    texture.number = first_number(r, texture);
    texture.file = frame_file(r, texture, texture.number);
    if (texture.file.empty())
        texture.file = r.client_state.files.existing(numbered(texture.sequence, 1)).string();
    put(r.client_state.textures, r.arguments, "name", texture);
}

/// The next picture of a sequence; texels that the client sends are used at once.
void update_dynamic(Request& r) {
    NamedTexture& texture = named_texture(r, "name");
    if (texture.sequence.empty()) return;
    std::int64_t next = texture.number + 1;
    if (frame_file(r, texture, next).empty()) next = texture.loop ? first_number(r, texture) : texture.number;
    texture.number = next;
    texture.file = frame_file(r, texture, next);
    for (auto& [object_name, object] : r.client_state.objects)
        for (const auto& [unit, worn] : object.worn_textures)
            if (worn == r.arguments.text("name")) wear(object, unit, texture.file);
}

void attach(Request& r) {
    const NamedTexture& texture = named_texture(r, "texture_name");
    Object& object = r.client_state.object(r.arguments.text("object_name"), r.command.name);
    if (object.kind != Object::Kind::body)
        throw r.arguments.refused("object_name", "is no body", "a body or a mesh");
    require_whole(r, object);
    const auto unit = static_cast<int>(r.arguments.integer("texture_unit_id", 0, texture_units - 1));
    if (!wear(object, unit, key_of(texture))) {
        r.reply.warn(fmt::format("{}: a texture of that unit has no effect on this object", r.command.name));
        return;
    }
    object.worn_textures[unit] = r.arguments.text("texture_name");
}

} // namespace

bool wear(Object& object, int unit, const nlohmann::json& file) {
    const std::string shape = object.keys.value("shape", "");
    const bool relief = shape == "planet" || shape == "terrain";
    switch (unit) {
    case 0:
        if (shape == "terrain") return false;
        if (relief)
            object.keys["albedo"] =
                nlohmann::json::array({{{"file", file}, {"projection", "simple_cylindrical"}}});
        else
            object.keys[object.keys.contains("emission_w_m2_sr") ? "emission_texture" : "albedo_texture"] =
                file;
        return true;
    case 2:
        if (relief) return false;
        object.keys["emission_texture"] = file;
        if (!object.keys.contains("emission_w_m2_sr")) object.keys["emission_w_m2_sr"] = {1.0, 1.0, 1.0, 1.0};
        return true;
    case 3:
        if (relief) return false;
        object.keys["normal_texture"] = file;
        return true;
    default: // specular
        return false;
    }
}

void add_texture_calls(Handlers& handlers) {
    handlers["createUserDataTexture"] = create;
    handlers["updateUserDataTexture"] = update;
    handlers["attachDynamicTexture"] = attach;
    handlers["updateDynamicTexture"] = update_dynamic;
    handlers["createVideoTexture"] = create_video;
    handlers["loadTextureObject"] = [](Request& r) {
        const std::string& file = r.arguments.text("filename");
        NamedTexture texture;
        if (file.ends_with(".txr"))
            texture.model = texture_of_file(r, r.client_state.files.existing(file));
        else
            texture.file = texture_file(r, file);
        put(r.client_state.textures, r.arguments, "name", texture);
    };
}

} // namespace obscura::serve::compatible
