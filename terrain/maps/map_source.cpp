// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/map_source.hpp"

#include "core/error.hpp"
#include "core/io/memory_budget.hpp"
#include "images/image.hpp"
#include "terrain/maps/memory_pyramid.hpp"
#include "terrain/obt/obt_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace obscura::terrain {
namespace {

/// Where the samples are, by the keys or by the file's label.
MapFrame frame_of(const MapKeys& keys, const MapLabel& label, const SurfaceDomain& domain, std::int64_t width,
                  std::int64_t height) {
    if (!keys.projection) {
        if (label.projection && label.transform)
            return {*label.projection, *label.transform, label.registration, width, height};
        throw std::invalid_argument(
            "the file has no label with its place on the body: give `projection` and its edges");
    }
    Projection p = Projection::of_sphere(*keys.projection, domain.is_plane() ? 1 : domain.radii_m().x,
                                         keys.centre_longitude_rad);
    p.latitudes = keys.latitudes;
    if (!domain.is_plane()) p.polar_radius_m = std::min(domain.radii_m().z, p.equatorial_radius_m);
    if (*keys.projection == ProjectionKind::simple_cylindrical)
        return MapFrame::by_edges(p, keys.registration, width, height, keys.left_rad, keys.right_rad,
                                  keys.top_rad, keys.bottom_rad);
    return {
        p, {keys.left_m, keys.pixel_m, 0, keys.top_m, 0, -keys.pixel_m}, keys.registration, width, height};
}

/// Heights or radii that cannot be those of the body.
void check_heights(const HeightRaster& raster, const SurfaceDomain& domain) {
    if (domain.is_plane()) return;
    const SamplePyramid& samples = raster.raster->samples();
    const double least = raster.offset_m + raster.scale_m * static_cast<double>(samples.least());
    const double largest = raster.offset_m + raster.scale_m * static_cast<double>(samples.largest());
    const Vec3 radii = domain.radii_m();
    const double min_radius = std::min({radii.x, radii.y, radii.z});
    const double largest_radius = std::max({radii.x, radii.y, radii.z});
    const bool radius = raster.meaning == HeightMeaning::radius;
    if (!radius && (largest > 0.5 * min_radius || least < -0.5 * min_radius))
        throw std::invalid_argument(
            fmt::format("heights from {:.6g} to {:.6g} m on a body of radius {:.6g} m; "
                        "if they are distances from the centre, set values = \"radius\"",
                        least, largest, min_radius));
    if (radius && (least < 0.1 * min_radius || largest > 2 * largest_radius))
        throw std::invalid_argument(
            fmt::format("distances from the centre from {:.6g} to {:.6g} m on a body of radius {:.6g} m; "
                        "if these are heights, set values = \"height\"",
                        least, largest, min_radius));
}

/// Range, edges and assumptions of an open map, and what is odd about them. `states_scale`: the file has a
/// unit or a scale.
void report_map(const MapKeys& keys, const MapLabel& label, const SurfaceDomain& domain,
                const HeightRaster& map, bool states_scale, MapFindings& found) {
    const std::string name = keys.file.string();
    const MapFrame& frame = map.raster->frame();
    const SamplePyramid& samples = map.raster->samples();
    const bool by_keys = keys.projection.has_value();
    const bool keys_scale = keys.scale_m != 1 || keys.offset_m != 0;
    const bool meaning_known = keys.meaning || label.meaning;
    found.notes.push_back(fmt::format(
        "{}: {} x {} samples, {} (by the {}, east positive), {}{} {:.8g} to {:.8g} m{}", name, frame.width(),
        frame.height(), edges_text(frame), by_keys ? "keys" : "file's label",
        map.meaning == HeightMeaning::radius ? "distances from the centre" : "heights",
        meaning_known ? "" : " (assumed)", map.offset_m + map.scale_m * static_cast<double>(samples.least()),
        map.offset_m + map.scale_m * static_cast<double>(samples.largest()),
        states_scale && !keys_scale ? ", by the file's unit and scale"
        : states_scale              ? ", by the file's unit and scale and those of the keys"
        : keys_scale                ? ", by scale_m and offset_m of the keys"
                                    : ", its numbers assumed to be metres without offset"));
    if (by_keys && label.projection && label.transform)
        if (const std::string text =
                moved_from_label(frame, {*label.projection, *label.transform, label.registration,
                                         frame.width(), frame.height()});
            !text.empty())
            found.warnings.push_back(fmt::format("{}: {}", name, text));
    if (const std::string text = odd_relief(map, domain); !text.empty())
        found.warnings.push_back(fmt::format("{}: {}", name, text));
    for (const std::string& text : label.warnings)
        found.warnings.push_back(fmt::format("{}: {}", name, text));
}

/// Phrase on an image whose numbers have their bytes the other way round; empty: they have not.
std::string swapped_text(const images::Image& image, const MapLabel& label) {
    const std::string type =
        swapped_bytes(image.values, image.width, label.number_scale, label.number_offset);
    if (type.empty()) return {};
    return fmt::format(
        "its numbers ({}) are noise as they are, and smooth with their bytes swapped: the file, or its label, has the wrong byte order",
        type);
}

HeightRaster open_image(const MapKeys& keys, const SurfaceDomain& domain, MapFindings& found) {
    const std::string name = keys.file.string();
    images::Image image = images::read_image(keys.file);
    const MapLabel label = read_map_label(keys.file, image.width, image.height);
    const std::int64_t pixels = std::int64_t{image.width} * image.height;
    if (pixels > max_memory_samples)
        throw std::invalid_argument(fmt::format(
            "{} x {} pixels; a raster of more than {} million is made a giant texture (.obt) by `obscura import map`",
            image.width, image.height, max_memory_samples / 1'000'000));
    require_memory(MemoryPyramid::bytes(image.width, image.height), name);
    HeightRaster made;
    const double scale = keys.scale_m * label.scale_m;
    made.meaning = keys.meaning.value_or(label.meaning.value_or(HeightMeaning::height));
    // Numbers are kept as floats: about their middle, so that radii do not lose the last decimetres.
    double least = std::numeric_limits<double>::infinity(), largest = -least;
    for (const double v : image.values)
        if (std::isfinite(v)) {
            least = std::min(least, v);
            largest = std::max(largest, v);
        }
    if (!(least <= largest)) throw std::invalid_argument("no pixel has data");
    const std::string swapped = swapped_text(image, label);
    if (!swapped.empty()) found.warnings.push_back(fmt::format("{}: {}", name, swapped));
    const double middle = std::round(0.5 * (least + largest));
    std::vector<float> samples(image.values.size());
    for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = std::isfinite(image.values[i]) ? static_cast<float>(image.values[i] - middle)
                                                    : std::numeric_limits<float>::quiet_NaN();
    image.values.clear();
    image.values.shrink_to_fit();
    made.scale_m = scale;
    made.offset_m = keys.offset_m + keys.scale_m * label.offset_m + scale * middle;
    const auto pyramid = std::make_shared<const MemoryPyramid>(image.width, image.height, std::move(samples));
    made.raster =
        std::make_shared<const Raster>(pyramid, map_frame(keys, label, domain, image.width, image.height));
    try {
        check_heights(made, domain);
    } catch (const std::invalid_argument&) {
        // What explains impossible heights goes before them.
        if (!swapped.empty()) throw std::invalid_argument(swapped);
        throw;
    }
    report_map(keys, label, domain, made, label.states_scale, found);
    return made;
}

HeightRaster open_texture(const MapKeys& keys, const SurfaceDomain& domain, MapFindings& found) {
    const auto file = std::make_shared<const ObtFile>(keys.file);
    const ObtMetadata& metadata = file->metadata();
    if (metadata.kind != ObtKind::heights || metadata.planes != 1)
        throw std::invalid_argument(
            fmt::format("a giant texture of {}, wanted is one of heights", name_of(metadata.kind)));
    if (metadata.unit != "m" && metadata.unit != "km")
        throw std::invalid_argument(fmt::format("heights in \"{}\", allowed are m and km", metadata.unit));
    HeightRaster made;
    made.scale_m = keys.scale_m * (metadata.unit == "km" ? 1000 : 1);
    made.offset_m = keys.offset_m;
    made.meaning = keys.meaning.value_or(metadata.height_meaning);
    MapLabel label;
    label.projection = metadata.projection;
    label.transform = metadata.transform;
    label.registration = metadata.registration;
    made.raster =
        std::make_shared<const Raster>(file, map_frame(keys, label, domain, metadata.width, metadata.height));
    label.meaning = made.meaning; // which its header always states, as the unit
    check_heights(made, domain);
    report_map(keys, label, domain, made, true, found);
    return made;
}

} // namespace

MapFrame map_frame(const MapKeys& keys, const MapLabel& label, const SurfaceDomain& domain,
                   std::int64_t width, std::int64_t height) {
    MapFrame frame = frame_of(keys, label, domain, width, height);
    const bool planar = frame.projection().kind == ProjectionKind::planar;
    if (planar != domain.is_plane())
        throw std::invalid_argument(planar ? "a planar map on a planet"
                                           : "a map of a planet on a plane; give projection = \"planar\"");
    return frame;
}

HeightRaster open_map(const MapKeys& keys, const SurfaceDomain& domain, MapFindings& found) {
    try {
        return ObtFile::is_one(keys.file) ? open_texture(keys, domain, found)
                                          : open_image(keys, domain, found);
    } catch (const std::invalid_argument& error) {
        throw InputError(fmt::format("{}: {}", keys.file.string(), error.what()));
    }
}

} // namespace obscura::terrain
