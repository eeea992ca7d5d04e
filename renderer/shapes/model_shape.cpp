// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/model_shape.hpp"

#include "core/error.hpp"
#include "models/kinds/shape_checks.hpp"
#include "models/kinds/shape_march.hpp"
#include "renderer/packets/detail_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace obscura::renderer {
namespace {

static_assert(packet_size == models::shape_lanes);

/// Traces the active rays up to t_max and, with `hits`, no farther than these; counts doubtful ones.
models::ShapeHits traced(const models::ShapeProgram& program, const RayPacket& packet,
                         const HitPacket* hits) {
    models::ShapeRays rays;
    rays.origin_error_m = packet.origin_error_m;
    for (int i = 0; i < packet_size; ++i) {
        const auto k = static_cast<std::size_t>(i);
        rays.origin[k] = packet.origin.lane(i);
        rays.direction[k] = packet.direction.lane(i);
        const double limit = hits != nullptr ? std::min(packet.t_max[i], hits->t[i]) : packet.t_max[i];
        rays.t_max[k] = packet.active.on[i] != 0 ? limit : 0;
    }
    models::ShapeHits found;
    trace(program, rays, found);
    if (packet.detail != nullptr && packet.detail->counts != nullptr)
        packet.detail->counts->doubtful +=
            static_cast<std::uint64_t>(std::count(found.doubtful.begin(), found.doubtful.end(), true));
    return found;
}

} // namespace

config::Keys ellipsoid_keys(ModelShapeParameters& p) {
    if (p.loaded == nullptr || p.loaded->model->function("height") == nullptr) return {};
    return {config::key("radii_m", &p.radii_m)
                .unit("m")
                .range(1e-6, 1e12)
                .required()
                .help("Three radii of the ellipsoid under the heights, along x, y and z of the body frame")};
}

scene::ParameterList declare(ModelShapeParameters& p) {
    scene::ParameterList list;
    if (p.loaded == nullptr) return list;
    for (config::Key& key : parameter_keys(p))
        list.push_back(std::move(key));
    for (config::Key& key : ellipsoid_keys(p))
        list.push_back(std::move(key));
    return list;
}

std::string identity_of(const ModelShapeParameters& p) {
    if (p.loaded == nullptr) return "";
    std::string text = p.loaded->model->text();
    for (const auto& values : p.values)
        for (const double value : values)
            fmt::format_to(std::back_inserter(text), " {}", value);
    return text + fmt::format(" {}", static_cast<int>(p.loaded->execution.target));
}

std::shared_ptr<const models::ShapeProgram> shape_program(const ModelShapeParameters& p) {
    if (p.loaded == nullptr)
        throw ConfigError("shape: the model's file is missing: write shape = { model = \"FILE.shp\" }");
    models::ShapeParameters parameters{models::program_parameters(p)};
    parameters.radii_m = p.radii_m;
    return std::make_shared<models::ShapeProgram>(p.loaded->model, parameters);
}

std::shared_ptr<const Shape> make(const ModelShapeParameters& p, ShapeContext& /*context*/) {
    return std::make_shared<ModelShape>(p);
}

ModelShape::ModelShape(const ModelShapeParameters& p) : program_(shape_program(p)) {
    models::ShapeReport report;
    p.loaded->execution.make([&] { report = models::report_on(*program_); });
    if (const std::string why = refusal_by(report, *program_); !why.empty())
        models::refuse(program_->model(), program_->place(), why);
    for (const std::string& warning : models::warnings_by(report, *program_))
        warnings_.push_back(fmt::format("{}: {}", program_->model().name(), warning));
}

void ModelShape::intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    const models::ShapeHits found = traced(*program_, rays, &hits);
    for (int i = 0; i < packet_size; ++i) {
        const double t = found.t[static_cast<std::size_t>(i)];
        if (rays.active.on[i] == 0 || !(t < hits.t[i]) || !(t < rays.t_max[i])) continue;
        hits.t[i] = t;
        hits.body[i] = body;
        hits.primitive[i] = 0;
    }
}

void ModelShape::occlude(RayPacket& rays) const {
    const models::ShapeHits found = traced(*program_, rays, nullptr);
    for (int i = 0; i < packet_size; ++i)
        if (found.t[static_cast<std::size_t>(i)] < rays.t_max[i]) rays.active.on[i] = 0;
}

void ModelShape::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                         SurfacePacket& out) const {
    for (int i = 0; i < packet_size; ++i)
        out.position.set(i, rays.origin.lane(i) +
                                (hits.body[i] == body ? hits.t[i] : 0.0) * rays.direction.lane(i));
    Doubles value;
    Vec3s gradient;
    program_->run({out.position.x.v, out.position.y.v, out.position.z.v},
                  {value.v, gradient.x.v, gradient.y.v, gradient.z.v}, packet_size);
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 d = rays.direction.lane(i);
        const double t = hits.body[i] == body ? hits.t[i] : 0.0;
        const double steepness = length(gradient.lane(i));
        // At an edge or an apex there may be no slope.
        Vec3 n = steepness > 0 && std::isfinite(steepness) ? gradient.lane(i) / steepness : -d;
        const bool behind = dot(n, d) > 0;
        if (behind) n = -n;
        out.normal.set(i, n);
        out.facet_normal.set(i, n);
        out.outside.on[i] = behind ? 0 : -1;
        // Secondary rays start clear of the surface by some units in the last place.
        out.shadow_origin.set(i, out.position.lane(i) + 1e-13 * (bounding_radius_m() + t) * n);
    }
}

} // namespace obscura::renderer
