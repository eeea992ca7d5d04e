// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/stray_light.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "images/image.hpp"
#include "renderer/camera/psf_file.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/scene/position.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

namespace obscura::renderer {

namespace {

/// One plane of a stray light map.
struct Plane {
    std::int32_t width, height;
    std::vector<double> values;
};

/// Reads all images and planes of a FITS file; from other formats one plane for all bands or one for each:
/// OpenEXR channels named as `obscura render` names them, or red, green and blue by wavelength.
std::vector<Plane> read_stray_planes(const std::filesystem::path& file,
                                     const std::vector<SpectralBand>& bands) {
    std::vector<Plane> planes;
    require_regular_file(file);
    std::array<char, 6> first{};
    std::ifstream(file, std::ios::binary).read(first.data(), first.size());
    if (std::string_view(first.data(), first.size()) == "SIMPLE") {
        for (PsfImage& image : read_psf_file(file))
            planes.push_back({image.width, image.height, std::move(image.values)});
        return planes;
    }
    const auto add = [&](const std::string& name) {
        images::Image image = images::read_image(file, name);
        for (const double v : image.values)
            if (!(v >= 0 && std::isfinite(v)))
                throw InputError(fmt::format("{}: {}: stray light has numbers from 0 up", file.string(), v));
        planes.push_back({image.width, image.height, std::move(image.values)});
    };
    const std::vector<std::string> names = images::colour_planes(file);
    if (names.size() != 3 || names[0] == "0") {
        std::vector<std::string> channels;
        for (const SpectralBand& band : bands)
            channels.push_back(fmt::format("irradiance.{}-{}nm", std::lround(1e9 * band.from_m),
                                           std::lround(1e9 * band.to_m)));
        if (images::has_plane(file, channels[0])) {
            for (const std::string& name : channels)
                add(name);
        } else {
            for (const std::string& name : names)
                add(name);
        }
        return planes;
    }
    for (const std::string& name : names)
        add(name);
    // Mix red, green and blue into the bands.
    std::vector<Plane> mixed;
    for (const SpectralBand& band : bands) {
        const std::array<double, 3> shares = colour_shares(band);
        Plane plane{planes[0].width, planes[0].height, std::vector<double>(planes[0].values.size(), 0)};
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t i = 0; i < plane.values.size(); ++i)
                plane.values[i] += shares[k] * planes[k].values[i];
        mixed.push_back(std::move(plane));
    }
    return mixed;
}

} // namespace

void StrayMap::add(std::int32_t x, std::int32_t y, double sun, std::size_t bands,
                   std::span<double> light) const {
    const std::size_t columns = light.size() / bands;
    const double scale = follows_sun ? sun : 1;
    for (std::size_t b = 0; b < bands; ++b) {
        const std::vector<double>& plane = w_m2[w_m2.size() > 1 ? b : 0];
        for (std::size_t i = 0; i < columns; ++i) {
            const std::int64_t column = x + static_cast<std::int64_t>(i);
            const std::int64_t at = static_cast<std::int64_t>(y) * width + column;
            // A window may lie partly off the sensor.
            if (column < 0 || column >= width || y < 0 || at >= static_cast<std::int64_t>(plane.size()))
                continue;
            light[b * columns + i] += scale * plane[static_cast<std::size_t>(at)];
        }
    }
}

std::vector<StrayMap> read_stray_light(const scene::Scene& scene) {
    std::vector<StrayMap> maps;
    for (const scene::StrayLight& description : scene.stray_light)
        scene::at_position(description.position, [&] {
            std::vector<Plane> planes = read_stray_planes(description.file, scene.bands);
            if (planes.size() != 1 && planes.size() != scene.bands.size())
                throw ConfigError(fmt::format(
                    "stray light: {} has {} planes: allowed are 1, or one for each of the {} bands",
                    description.file, planes.size(), scene.bands.size()));
            StrayMap map;
            map.width = scene.camera.width;
            map.follows_sun = description.follows_sun;
            for (Plane& plane : planes) {
                if (plane.width != scene.camera.width || plane.height != scene.camera.height)
                    throw ConfigError(fmt::format("stray light: {} is {} x {}: the sensor has {} x {} pixels",
                                                  description.file, plane.width, plane.height,
                                                  scene.camera.width, scene.camera.height));
                map.w_m2.push_back(std::move(plane.values));
                for (double& v : map.w_m2.back())
                    v *= description.w_m2_per_unit;
            }
            maps.push_back(std::move(map));
        });
    return maps;
}

} // namespace obscura::renderer
