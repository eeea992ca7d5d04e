// SPDX-License-Identifier: Apache-2.0
#include "renderer/mesh_files/mesh_file.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/memory_budget.hpp"
#include "core/io/stop_reading.hpp"
#include "core/io/text_file.hpp"
#include "core/realtime/log.hpp"
#include "core/text/printable.hpp"
#include "core/text/text.hpp"
#include "renderer/mesh_files/assimp.hpp"
#include "renderer/mesh_files/obj.hpp"
#include "renderer/mesh_files/plate.hpp"
#include "renderer/mesh_files/text_lines.hpp"
#include "renderer/mesh_files/vertex_normals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>

namespace obscura::renderer {
namespace {

std::string text_of(const std::filesystem::path& file, const char* kind) {
    // The text, and what it describes.
    require_permission(file);
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    if (!error) require_memory(4 * bytes, file.string());
    std::string text;
    if (const std::string why = read_plain_text(file, std::numeric_limits<std::size_t>::max(), text);
        !why.empty())
        throw InputError(
            fmt::format("{}: cannot open: a readable {} is wanted: {}", file.string(), kind, why));
    return text;
}

/// Warns of material libraries that an OBJ text names and that cannot be opened: assimp reads on without.
void warn_of_missing_libraries(std::string_view text, const std::filesystem::path& file) {
    // Where one is missing, assimp takes that of the file's own name.
    std::error_code error;
    if (std::filesystem::is_regular_file(std::filesystem::path(file).replace_extension(".mtl"), error))
        return;
    std::set<std::string_view> names;
    for (std::size_t line = 1; !text.empty(); ++line) {
        constexpr std::size_t lines_between_checks = 1 << 16;
        if (line % lines_between_checks == 0) check_reading();
        const std::string_view words = trimmed(take_line(text));
        if (!words.starts_with("mtllib ") && !words.starts_with("mtllib\t")) continue;
        const std::string_view name = trimmed(words.substr(6));
        if (!names.insert(name).second) continue;
        if (std::filesystem::is_regular_file(file.parent_path() / name, error)) continue;
        log_warning("mesh: {}:{}: material library '{}' cannot be opened: {}; its materials are grey, of "
                    "reflectance 0.6",
                    file.string(), line, printable(name), error ? error.message() : "not a regular file");
    }
}

TriangleMesh read(const MeshFileParameters& description) {
    const std::filesystem::path file = description.path;
    const std::string end = lower_case(file.extension().string());
    if (end == ".tab" || end == ".plt" || end == ".txt")
        return parse_plates(text_of(file, "plate model"), file.string(), description.metres_per_unit);
    if (end == ".obj") {
        const std::string text = text_of(file, "mesh file");
        if (is_bare_obj(text)) return parse_obj(text, file.string(), description.metres_per_unit);
        warn_of_missing_libraries(text, file);
    }
    constexpr std::array known{".obj", ".stl", ".ply", ".3ds", ".dae", ".gltf", ".glb"};
    if (std::find(known.begin(), known.end(), end) == known.end())
        throw InputError(fmt::format(
            "{}: mesh files whose names end in \"{}\" are not supported, allowed are {}, .tab, .plt, .txt",
            file.string(), end, fmt::join(known, ", ")));
    return read_with_assimp(file, description.metres_per_unit, description.smooth_normals);
}

} // namespace

bool is_bare_obj(std::string_view text) {
    while (!text.empty()) {
        std::string_view line = take_line(text);
        line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
        for (const std::string_view word : {"vn", "vt", "mtllib", "usemtl"})
            if (line.starts_with(word)) return false;
    }
    return true;
}

TriangleMesh read_mesh_file(const MeshFileParameters& description) {
    TriangleMesh mesh = read(description);
    note_input(description.path);
    if (description.smooth_normals)
        complete_normals(mesh);
    else
        mesh.normals = {};
    return mesh;
}

} // namespace obscura::renderer
