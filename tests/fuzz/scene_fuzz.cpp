// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: a whole scene file, from its text to a picture of a few pixels. Whatever it says, it is
// refused with a line for each mistake or rendered to numbers from 0 up. The files beside it (mesh, textures,
// tables) are good ones; others' readers have targets of their own.
#include "core/error.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/renderer.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "tests/fuzz/scratch_folder.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

using namespace obscura;
using test::require;

namespace {

/// Four texels of 8 bits: 0, 64, 128, 255.
std::string fits() {
    std::string text;
    for (const std::string_view card : {"SIMPLE  =                    T", "BITPIX  =                    8",
                                        "NAXIS   =                    2", "NAXIS1  =                    2",
                                        "NAXIS2  =                    2", "END"}) {
        text += card;
        text.resize((text.size() + 79) / 80 * 80, ' ');
    }
    text.resize(2880, ' ');
    for (const int texel : {0, 64, 128, 255})
        text += static_cast<char>(texel);
    text.resize(5760, '\0');
    return text;
}

/// What scenes refer to.
struct Folder : test::ScratchFolder {
    Folder() {
        (void)write("m.obj", "v 1 0 0\nv -1 1 0\nv -1 -1 0\nv 0 0 1\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 1 3 2\n");
        (void)write("t.fits", fits());
        (void)write("s.csv", "ra_deg,dec_deg,v_mag,b_v\n84,-1,2,0\n84.1,-1.2,3,0.5\n");
        (void)write("j.csv", "time_s,angle_deg\n0,0\n10,90\n");
        (void)write("p.csv", "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,-9,1,0,0,0\n9,0,1,-9,1,0,0,0\n");
    }
};

/// Whether a file is one of those above: a scene may name any file that the machine has.
bool ours(const std::string& file, const std::filesystem::path& folder) {
    return file.empty() || std::filesystem::path(file).parent_path() == folder;
}

/// Scenes that only take long: large noise, finely resolved spreads of light, long lists.
bool heavy(const scene::Scene& s, const std::filesystem::path& folder) {
    if (s.bodies.size() > 8 || s.lamps.size() > 8 || s.bands.size() > 4 || s.stray_light.size() > 2)
        return true;
    if (s.camera.psf.model != scene::PointSpread::Model::gaussian || s.camera.psf.defocus_m != 0 ||
        s.camera.psf.wings_px > 64)
        return true;
    if (static_cast<std::int64_t>(s.camera.width) * s.camera.height > 1 << 20) return true;
    for (const scene::Body& body : s.bodies) {
        const auto* noise = body.shape.get_if<renderer::ProceduralBodyParameters>();
        if (noise != nullptr && noise->subdivisions > 3) return true;
        const auto* mesh = body.shape.get_if<renderer::MeshFileParameters>();
        // Formats of assimp are read by a process of its own: slow, and not what is tried here.
        if (mesh != nullptr && std::filesystem::path(mesh->path).filename() != "m.obj") return true;
        if (!ours(body.textures.albedo, folder) || !ours(body.textures.normal, folder)) return true;
        for (const auto& map : body.textures.parameters)
            if (!ours(map.file, folder)) return true;
    }
    for (const scene::StrayLight& map : s.stray_light)
        if (!ours(map.file, folder)) return true;
    return false;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Folder folder;
    // Paths that lead elsewhere could be devices or anything.
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    if (size > 16384 || text.find("..") != text.npos || text.find('/') != text.npos) return 0;
    try {
        scene::Scene s = scene::load_scene(folder.write("scene.toml", text));
        if (heavy(s, folder.path())) return 0;
        s.max_bounces = std::min(s.max_bounces, 3U);
        renderer::RenderSettings settings;
        settings.samples_per_pixel = 1;
        settings.threads = 1;
        const renderer::Renderer r(s, settings);
        // Four corners' worth of pixels: the middle of the sensor.
        renderer::RenderRequest request;
        request.window = {s.camera.width / 2, s.camera.height / 2,
                          std::min(s.camera.width - s.camera.width / 2, 8),
                          std::min(s.camera.height - s.camera.height / 2, 4)};
        request.rows = request.window.height;
        const std::vector<RowTime> times(static_cast<std::size_t>(request.rows));
        request.row_times = times;
        std::vector<float> light(r.band_count() * static_cast<std::size_t>(request.window.width) *
                                 static_cast<std::size_t>(request.rows));
        r.render(request, light);
        for (const float v : light)
            require(v >= 0); // not NaN either
    } catch (const Error& error) {
        const std::string_view what = error.what();
        require(!what.empty());
        for (const char c : what)
            require((static_cast<unsigned char>(c) >= 0x20 && c != 0x7F) || c == '\n');
    }
    return 0;
}
