// SPDX-License-Identifier: Apache-2.0
#include "renderer/packets/frames.hpp"

namespace obscura::renderer {

OBSCURA_VECTOR_CLONES
void transform(const Mat3& m, const Vec3s& in, Vec3 offset, Vec3s& out) {
    for (int i = 0; i < packet_size; ++i) {
        const double x = in.x.v[i];
        const double y = in.y.v[i];
        const double z = in.z.v[i];
        out.x.v[i] = m.m[0][0] * x + m.m[0][1] * y + m.m[0][2] * z + offset.x;
        out.y.v[i] = m.m[1][0] * x + m.m[1][1] * y + m.m[1][2] * z + offset.y;
        out.z.v[i] = m.m[2][0] * x + m.m[2][1] * y + m.m[2][2] * z + offset.z;
    }
}

OBSCURA_VECTOR_CLONES
void transform_tilted(const Mat3& m, const Vec3s& in, Vec3 beta, Vec3s& out, Doubles& stretch) {
    for (int i = 0; i < packet_size; ++i) {
        const double x = in.x.v[i];
        const double y = in.y.v[i];
        const double z = in.z.v[i];
        const double a = m.m[0][0] * x + m.m[0][1] * y + m.m[0][2] * z + beta.x;
        const double b = m.m[1][0] * x + m.m[1][1] * y + m.m[1][2] * z + beta.y;
        const double c = m.m[2][0] * x + m.m[2][1] * y + m.m[2][2] * z + beta.z;
        const double norm = __builtin_sqrt(a * a + b * b + c * c);
        out.x.v[i] = a / norm;
        out.y.v[i] = b / norm;
        out.z.v[i] = c / norm;
        stretch.v[i] = norm;
    }
}

} // namespace obscura::renderer
