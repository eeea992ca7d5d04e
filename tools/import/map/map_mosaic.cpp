// SPDX-License-Identifier: Apache-2.0
#include "tools/import/map/map_mosaic.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::tools {
namespace {

using terrain::MapFrame;

/// Part of a pixel by which maps of one grid may differ: labels are rounded.
constexpr double same_place = 0.02;

MapFrame frame_of(const MapSource& map) {
    const Georeference& g = map.place();
    return {g.projection, g.transform, g.registration, map.width(), map.height()};
}

/// Moves maps by whole turns so that all of them together are as narrow as they can be.
void close_ranks(std::vector<std::int64_t>& x, const std::vector<std::int64_t>& width, std::int64_t turn) {
    const auto from = [&](std::int64_t v, std::int64_t begin) { return ((v - begin) % turn + turn) % turn; };
    std::int64_t best = 0, narrowest = -1;
    for (const std::int64_t begin : x) {
        std::int64_t end = 0;
        for (std::size_t i = 0; i < x.size(); ++i)
            end = std::max(end, from(x[i], begin) + width[i]);
        if (narrowest >= 0 && end >= narrowest) continue;
        narrowest = end;
        best = begin;
    }
    for (std::int64_t& v : x)
        v = best + from(v, best);
}

} // namespace

MapMosaic::MapMosaic(std::vector<std::unique_ptr<MapSource>> maps) : maps_(std::move(maps)) {
    const MapSource& first = *maps_.front();
    const MapFrame base = frame_of(first);
    std::vector<std::int64_t> x, width;
    for (const auto& map : maps_) {
        const auto refuse = [&](const std::string& why) {
            throw InputError(fmt::format(
                "{}: {} {}: maps of one file share a grid (several height tables of a scene take others)",
                map->name(), why, first.name()));
        };
        const MapFrame frame = frame_of(*map);
        if (frame.projection().kind != base.projection().kind ||
            frame.registration() != base.registration() ||
            frame.projection().latitudes != base.projection().latitudes ||
            frame.projection().equatorial_radius_m != base.projection().equatorial_radius_m ||
            frame.projection().polar_radius_m != base.projection().polar_radius_m)
            refuse("has another projection, radius or registration than");
        if (map->planes() != first.planes() || map->numbers().type != first.numbers().type)
            refuse("has other bands or another type of samples than");
        if (map->numbers().scale != first.numbers().scale ||
            map->numbers().offset != first.numbers().offset || map->numbers().unit != first.numbers().unit)
            refuse("has another scale, offset or unit than");
        // Two points of the map in the grid of the first. The middle: at a pole there is no longitude.
        const terrain::SamplePlace middle{static_cast<double>(map->width() / 2),
                                          static_cast<double>(map->height() / 2)};
        const terrain::SamplePlace beside{middle.x / 2, middle.y / 2};
        const terrain::SamplePlace a = base.place(frame.position(middle)),
                                   b = base.place(frame.position(beside));
        const double dx = a.x - middle.x, dy = a.y - middle.y;
        const double turn = base.projection().turn_m() / std::abs(base.transform()[1]);
        double stretch = b.x - beside.x - dx;
        if (turn > 0) stretch = std::remainder(stretch, turn);
        if (std::abs(stretch) > same_place || std::abs(b.y - beside.y - dy) > same_place)
            refuse("has pixels of another size than");
        if (std::abs(dx - std::round(dx)) > same_place || std::abs(dy - std::round(dy)) > same_place)
            refuse(fmt::format("lies {:.3g}, {:.3g} of a pixel off the grid of", dx - std::round(dx),
                               dy - std::round(dy)));
        x.push_back(std::llround(dx));
        width.push_back(map->width());
        parts_.push_back({0, std::llround(dy)});
    }
    const double turn = base.projection().turn_m() / std::abs(base.transform()[1]);
    if (turn > 0 && std::abs(turn - std::round(turn)) < same_place && maps_.size() > 1)
        close_ranks(x, width, std::llround(turn));
    std::int64_t left = x[0], right = x[0], top = 0, bottom = 0;
    double covered = 0;
    for (std::size_t i = 0; i < maps_.size(); ++i) {
        parts_[i].x = x[i];
        left = std::min(left, x[i]);
        right = std::max(right, x[i] + maps_[i]->width());
        top = std::min(top, parts_[i].y);
        bottom = std::max(bottom, parts_[i].y + maps_[i]->height());
        covered += static_cast<double>(maps_[i]->width()) * static_cast<double>(maps_[i]->height());
    }
    const std::int64_t first_x = parts_[0].x;
    for (Part& part : parts_) {
        part.x -= left;
        part.y -= top;
    }
    terrain::PixelTransform t = base.transform();
    const auto dx = static_cast<double>(left - first_x), dy = static_cast<double>(top);
    t[0] += dx * t[1] + dy * t[2];
    t[3] += dx * t[4] + dy * t[5];
    try {
        frame_ = MapFrame(base.projection(), t, base.registration(), right - left, bottom - top);
    } catch (const std::invalid_argument& error) {
        throw InputError(fmt::format("{}: together with the others: {}", first.name(), error.what()));
    }
    // Maps that overlap may still leave gaps: then missing samples are found when they are read.
    has_gaps_ =
        maps_.size() > 1 && covered != static_cast<double>(right - left) * static_cast<double>(bottom - top);
}

bool MapMosaic::by_rows() const {
    return std::all_of(maps_.begin(), maps_.end(), [](const auto& map) { return map->by_rows(); });
}

void MapMosaic::read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
                     std::span<float> out) {
    if (maps_.size() == 1) return maps_[0]->read(plane, x, y, columns, rows, out);
    std::fill(out.begin(), out.end(), std::numeric_limits<float>::quiet_NaN());
    std::vector<float> block;
    for (std::size_t i = 0; i < maps_.size(); ++i) {
        const std::int64_t left = std::max(x, parts_[i].x),
                           right = std::min(x + columns, parts_[i].x + maps_[i]->width());
        const std::int64_t top = std::max(y, parts_[i].y),
                           bottom = std::min(y + rows, parts_[i].y + maps_[i]->height());
        if (left >= right || top >= bottom) continue;
        const auto across = static_cast<std::size_t>(right - left),
                   down = static_cast<std::size_t>(bottom - top);
        block.resize(across * down);
        maps_[i]->read(plane, left - parts_[i].x, top - parts_[i].y, static_cast<int>(across),
                       static_cast<int>(down), block);
        for (std::size_t r = 0; r < down; ++r) {
            float* to = out.data() +
                        (static_cast<std::size_t>(top - y) + r) * static_cast<std::size_t>(columns) +
                        static_cast<std::size_t>(left - x);
            const float* from = block.data() + r * across;
            for (std::size_t c = 0; c < across; ++c)
                if (std::isnan(to[c])) to[c] = from[c];
        }
    }
}

} // namespace obscura::tools
