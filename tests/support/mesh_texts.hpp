// SPDX-License-Identifier: Apache-2.0
// Writers of the same facets in every mesh format, with a material "blue" where the format has them.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace obscura::test {

/// Triangles with shared corners, counter-clockwise seen from outside; at most 65535 of each.
struct Facets {
    std::vector<std::array<float, 3>> corners;
    std::vector<std::array<std::uint16_t, 3>> faces;
};

inline std::string obj_text(const Facets& of) {
    std::string text;
    for (const auto& c : of.corners)
        text += fmt::format("v {}\n", fmt::join(c, " "));
    for (const auto& f : of.faces)
        text += fmt::format("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1);
    return text;
}

/// Plate model with a table of vertices and one of plates.
inline std::string plate_text(const Facets& of) {
    std::string text = fmt::format("{} {}\n", of.corners.size(), of.faces.size());
    for (const auto& c : of.corners)
        text += fmt::format("{}\n", fmt::join(c, " "));
    for (const auto& f : of.faces)
        text += fmt::format("{} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1);
    return text;
}

inline std::string stl_text(const Facets& of) {
    std::string text = "solid t\n";
    for (const auto& f : of.faces) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const unsigned i : f)
            text += fmt::format("vertex {}\n", fmt::join(of.corners[i], " "));
        text += "endloop\nendfacet\n";
    }
    return text + "endsolid t\n";
}

/// With the normal `normal` of every vertex, unless it is empty.
inline std::string ply_text(const Facets& of, const std::string& normal = {}) {
    std::string text = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float "
        "y\nproperty float z\n{}element face {}\nproperty list uchar int "
        "vertex_indices\nend_header\n",
        of.corners.size(), normal.empty() ? "" : "property float nx\nproperty float ny\nproperty float nz\n",
        of.faces.size());
    for (const auto& c : of.corners)
        text += fmt::format("{} {}\n", fmt::join(c, " "), normal);
    for (const auto& f : of.faces)
        text += fmt::format("3 {}\n", fmt::join(f, " "));
    return text;
}

inline std::string collada_text(const Facets& of, const char* up, double unit) {
    std::string positions, indices;
    for (const auto& c : of.corners)
        positions += fmt::format("{} ", fmt::join(c, " "));
    for (const auto& f : of.faces)
        indices += fmt::format("{} ", fmt::join(f, " "));
    return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="u" meter=")" +
           std::to_string(unit) + R"("/><up_axis>)" + up + R"(</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="c"><lambert><diffuse><color>0.25 0.5 0.75 1</color>
</diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m" name="blue"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count=")" +
           std::to_string(3 * of.corners.size()) + "\">" + positions +
           R"(</float_array><technique_common><accessor source="#a" count=")" +
           std::to_string(of.corners.size()) + R"(" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>
</source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count=")" +
           std::to_string(of.faces.size()) +
           R"(" material="s"><input semantic="VERTEX" source="#v" offset="0"/><p>)" + indices +
           R"(</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="w"><node><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>)";
}

inline std::string base64(const std::string& bytes) {
    constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        unsigned word = 0;
        for (std::size_t k = 0; k < 3; ++k)
            word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
        for (std::size_t k = 0; k < 4; ++k)
            out += i + k > bytes.size() ? '=' : digits[word >> (18 - 6 * k) & 63];
    }
    return out;
}

inline std::string gltf_text(const Facets& of) {
    const std::size_t positions = sizeof of.corners[0] * of.corners.size();
    const std::size_t indices = sizeof of.faces[0] * of.faces.size();
    std::string bytes(reinterpret_cast<const char*>(of.corners.data()), positions);
    bytes.append(reinterpret_cast<const char*>(of.faces.data()), indices);
    std::array<float, 3> least = of.corners[0], most = of.corners[0];
    for (const auto& c : of.corners)
        for (std::size_t k = 0; k < 3; ++k) {
            least[k] = std::min(least[k], c[k]);
            most[k] = std::max(most[k], c[k]);
        }
    return fmt::format(
        R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
"materials":[{{"name":"blue","pbrMetallicRoughness":{{"baseColorFactor":[0.25,0.5,0.75,1]}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0}}]}}],
"buffers":[{{"byteLength":{},"uri":"data:application/octet-stream;base64,{}"}}],
"bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":{}}},{{"buffer":0,"byteOffset":{},"byteLength":{}}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3","min":[{}],"max":[{}]}},
{{"bufferView":1,"componentType":5123,"count":{},"type":"SCALAR"}}]}})",
        positions + indices, base64(bytes), positions, positions, indices, of.corners.size(),
        fmt::join(least, ","), fmt::join(most, ","), 3 * of.faces.size());
}

/// 3D Studio: chunks of a 16-bit name and a 32-bit length.
inline std::string chunk(unsigned name, const std::string& content) {
    std::string out;
    const std::size_t length = content.size() + 6;
    for (const unsigned shift : {0U, 8U})
        out += static_cast<char>(name >> shift & 255);
    for (const unsigned shift : {0U, 8U, 16U, 24U})
        out += static_cast<char>(length >> shift & 255);
    return out + content;
}
inline std::string word(unsigned value) {
    return {static_cast<char>(value & 255), static_cast<char>(value >> 8 & 255)};
}

inline std::string studio_bytes(const Facets& of) {
    std::string points = word(static_cast<unsigned>(of.corners.size()));
    points.append(reinterpret_cast<const char*>(of.corners.data()), sizeof of.corners[0] * of.corners.size());
    const auto count = static_cast<unsigned>(of.faces.size());
    std::string triangles = word(count);
    std::string used = std::string("blue\0", 5) + word(count);
    for (unsigned i = 0; i < count; ++i) {
        for (const unsigned corner : of.faces[i])
            triangles += word(corner);
        triangles += word(7);
        used += word(i);
    }
    const std::string mesh =
        chunk(0x4100, chunk(0x4110, points) + chunk(0x4120, triangles + chunk(0x4130, used)));
    const std::string material =
        chunk(0xAFFF, chunk(0xA000, std::string("blue\0", 5)) +
                          chunk(0xA020, chunk(0x0011, {static_cast<char>(64), static_cast<char>(128),
                                                       static_cast<char>(191)})));
    return chunk(0x4D4D, chunk(0x3D3D, material + chunk(0x4000, std::string("t\0", 2) + mesh)));
}

} // namespace obscura::test
