#include "renderer/stray_light.hpp"

#include "core/error.hpp"
#include "renderer/psf_file.hpp"

#include <fmt/format.h>

namespace obscura::renderer {

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
    for (const scene::StrayLight& description : scene.stray_light) {
        const std::vector<PsfImage> planes = read_psf_file(description.file);
        if (planes.size() != 1 && planes.size() != scene.bands.size())
            throw ConfigError(
                fmt::format("stray light: {} has {} planes: allowed are 1, or one for each of the "
                            "{} bands",
                            description.file, planes.size(), scene.bands.size()));
        StrayMap map;
        map.width = scene.camera.width;
        map.follows_sun = description.follows_sun;
        for (const PsfImage& plane : planes) {
            if (plane.width != scene.camera.width || plane.height != scene.camera.height)
                throw ConfigError(fmt::format("stray light: {} is {} x {}: the sensor has {} x {} pixels",
                                              description.file, plane.width, plane.height, scene.camera.width,
                                              scene.camera.height));
            map.w_m2.push_back(plane.values);
            for (double& v : map.w_m2.back())
                v *= description.w_m2_per_unit;
        }
        maps.push_back(std::move(map));
    }
    return maps;
}

} // namespace obscura::renderer
