// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/material.hpp"

#include "renderer/materials/hemisphere.hpp"

#include <numbers>

namespace obscura::renderer {

Vec3 Material::sample(Vec3 /*out*/, double u, double v) const {
    return cosine_hemisphere(u, v);
}

double Material::pdf(Vec3 /*out*/, Vec3 in) const {
    return in.z > 0 ? in.z * std::numbers::inv_pi : 0.0;
}

} // namespace obscura::renderer
