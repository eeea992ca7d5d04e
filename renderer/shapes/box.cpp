// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/box.hpp"

#include <array>

namespace obscura::renderer {

scene::ParameterList declare(BoxParameters& p) {
    return {config::key("size_m", &p.size_m)
                .unit("m")
                .range(1e-6, 1e12)
                .required()
                .help("Three edges of the box, along x, y and z of the body frame")};
}

std::shared_ptr<const Shape> make(const BoxParameters& p, ShapeContext& /*context*/) {
    return std::make_shared<Box>(p);
}

Box::Box(const BoxParameters& d) : AnalyticShape(length(d.size_m) / 2 * (1 + 1e-12)), half_(d.size_m / 2) {}

// Between three pairs of planes; faces 2 k and 2 k + 1 are the lower and upper side along axis k.
AnalyticShape::Crossings Box::crossings(Vec3 o, Vec3 d) const {
    const std::array<double, 3> origin{o.x, o.y, o.z};
    const std::array<double, 3> direction{d.x, d.y, d.z};
    const std::array<double, 3> half{half_.x, half_.y, half_.z};
    Crossing in{-no_hit, 0};
    Crossing out{no_hit, 0};
    for (std::uint32_t k = 0; k < 3; ++k) {
        if (direction[k] == 0) {
            if (origin[k] < -half[k] || origin[k] > half[k]) return {};
            continue;
        }
        const double low = (-half[k] - origin[k]) / direction[k];
        const double high = (half[k] - origin[k]) / direction[k];
        const bool forward = low < high;
        const Crossing first{forward ? low : high, 2 * k + (forward ? 0 : 1)};
        const Crossing last{forward ? high : low, 2 * k + (forward ? 1 : 0)};
        if (first.t > in.t) in = first;
        if (last.t < out.t) out = last;
    }
    Crossings all;
    if (in.t > out.t) return all;
    all.add(in.t, in.face);
    all.add(out.t, out.face);
    return all;
}

Vec3 Box::normal(Vec3 /*point*/, std::uint32_t face) const {
    const double sign = face % 2 == 0 ? -1 : 1;
    return face < 2 ? Vec3{sign, 0, 0} : face < 4 ? Vec3{0, sign, 0} : Vec3{0, 0, sign};
}

} // namespace obscura::renderer
