// SPDX-License-Identifier: Apache-2.0
#include "renderer/textures/texture_place.hpp"

#include "core/error.hpp"
#include "terrain/maps/map_source.hpp"
#include "terrain/obt/obt_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace obscura::renderer {

TexturePlace::TexturePlace(const terrain::MapFrame& frame) : frame_(frame) {
    constexpr double any = std::numeric_limits<double>::infinity();
    const double edge = frame.registration() == terrain::Registration::pixel ? 0.5 : 0;
    const bool turn = frame.period() > 0;
    least_x_ = turn ? -any : -edge;
    largest_x_ = turn ? any : static_cast<double>(frame.width() - 1) + edge;
    least_y_ = std::isnan(frame.first_pole_y()) ? -edge : -any;
    largest_y_ = std::isnan(frame.last_pole_y()) ? static_cast<double>(frame.height() - 1) + edge : any;
    if (planar()) return;
    // Points of a golden spiral.
    constexpr int points = 4096;
    int inside = 0;
    for (int k = 0; k < points; ++k) {
        const double z = 1 - (2 * k + 1.0) / points, rho = std::sqrt(1 - z * z);
        const double turned = std::numbers::pi * (3 - std::sqrt(5.0)) * k;
        double u = 0, v = 0;
        inside += coordinates({rho * std::cos(turned), rho * std::sin(turned), z}, u, v) ? 1 : 0;
    }
    share_ = static_cast<double>(inside) / points;
}

bool TexturePlace::coordinates(Vec3 p, double& u, double& v) const {
    const terrain::SamplePlace at = frame_.place(p);
    if (!(at.x >= least_x_ && at.x <= largest_x_ && at.y >= least_y_ && at.y <= largest_y_)) return false;
    u = (at.x + 0.5) / static_cast<double>(frame_.width());
    v = (at.y + 0.5) / static_cast<double>(frame_.height());
    return true;
}

TextureAxis TexturePlace::axis(Vec3 p, Vec3 step_m) const {
    const terrain::SamplePlace step = frame_.step(p, step_m);
    const TextureAxis axis{step.x / static_cast<double>(frame_.width()),
                           step.y / static_cast<double>(frame_.height())};
    return std::isfinite(axis.u) && std::isfinite(axis.v) ? axis : TextureAxis{1, 0}; // at a pole
}

void TexturePlace::gradients(Vec3 p, Vec3& grad_u, Vec3& grad_v) const {
    const TextureAxis x = axis(p, {1, 0, 0}), y = axis(p, {0, 1, 0}), z = axis(p, {0, 0, 1});
    grad_u = {x.u, y.u, z.u};
    grad_v = {x.v, y.v, z.v};
}

std::shared_ptr<const TexturePlace> read_texture_place(const std::filesystem::path& file, std::int64_t width,
                                                       std::int64_t height, bool planar) {
    try {
        std::optional<terrain::MapFrame> frame;
        if (terrain::ObtFile::is_one(file)) {
            frame = terrain::ObtFile(file).metadata().frame();
        } else {
            const terrain::MapLabel label = terrain::read_map_label(file, width, height);
            if (label.projection && label.transform)
                frame.emplace(*label.projection, *label.transform, label.registration, width, height);
        }
        if (!frame || (frame->projection().kind == terrain::ProjectionKind::planar) != planar) return nullptr;
        return std::make_shared<const TexturePlace>(*frame);
    } catch (const std::invalid_argument& error) {
        throw InputError(fmt::format("{}: {}", file.string(), error.what()));
    }
}

} // namespace obscura::renderer
