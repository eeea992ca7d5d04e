// SPDX-License-Identifier: Apache-2.0
#include "core/geometry.hpp"

#include <algorithm>
#include <stdexcept>

namespace obscura {

Quat normalized(Quat q) {
    const double n = norm(q);
    return {q.w / n, q.x / n, q.y / n, q.z / n};
}

Quat axis_angle(Vec3 axis, double angle_rad) {
    const Vec3 n = normalized(axis);
    const double s = std::sin(angle_rad / 2);
    return {std::cos(angle_rad / 2), n.x * s, n.y * s, n.z * s};
}

Mat3 to_matrix(Quat q) {
    Mat3 r;
    const Vec3 columns[3] = {rotate(q, {1, 0, 0}), rotate(q, {0, 1, 0}), rotate(q, {0, 0, 1})};
    for (int c = 0; c < 3; ++c) {
        r.m[0][c] = columns[c].x;
        r.m[1][c] = columns[c].y;
        r.m[2][c] = columns[c].z;
    }
    return r;
}

Quat from_matrix(const Mat3& a) {
    // Shepperd's method: divide by the largest of the four candidates, so that no cancellation occurs.
    const auto& m = a.m;
    const double trace = m[0][0] + m[1][1] + m[2][2];
    Quat q;
    if (trace >= std::max({m[0][0], m[1][1], m[2][2]})) {
        q = {1 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]};
    } else if (m[0][0] >= std::max(m[1][1], m[2][2])) {
        q = {m[2][1] - m[1][2], 1 + m[0][0] - m[1][1] - m[2][2], m[0][1] + m[1][0], m[0][2] + m[2][0]};
    } else if (m[1][1] >= m[2][2]) {
        q = {m[0][2] - m[2][0], m[0][1] + m[1][0], 1 - m[0][0] + m[1][1] - m[2][2], m[1][2] + m[2][1]};
    } else {
        q = {m[1][0] - m[0][1], m[0][2] + m[2][0], m[1][2] + m[2][1], 1 - m[0][0] - m[1][1] + m[2][2]};
    }
    q = normalized(q);
    return q.w < 0 ? Quat{-q.w, -q.x, -q.y, -q.z} : q;
}

Quat slerp(Quat a, Quat b, double s) {
    double d = dot(a, b);
    if (d < 0) {
        b = {-b.w, -b.x, -b.y, -b.z};
        d = -d;
    }
    double wa = 1 - s;
    double wb = s;
    if (d < 1 - 1e-12) {
        const double angle = std::acos(std::min(d, 1.0));
        const double inv = 1 / std::sin(angle);
        wa = std::sin((1 - s) * angle) * inv;
        wb = std::sin(s * angle) * inv;
    }
    return normalized(
        Quat{wa * a.w + wb * b.w, wa * a.x + wb * b.x, wa * a.y + wb * b.y, wa * a.z + wb * b.z});
}

Quat look_along(Vec3 boresight, Vec3 up) {
    const Vec3 right = cross(boresight, up);
    if (!(length(right) > 1e-12 * length(boresight) * length(up)))
        throw std::invalid_argument("boresight and up must be finite, not zero and not parallel");
    const Vec3 z = normalized(boresight);
    const Vec3 x = normalized(right);
    const Vec3 y = cross(z, x);
    Mat3 m;
    m.m[0][0] = x.x, m.m[0][1] = y.x, m.m[0][2] = z.x;
    m.m[1][0] = x.y, m.m[1][1] = y.y, m.m[1][2] = z.y;
    m.m[2][0] = x.z, m.m[2][1] = y.z, m.m[2][2] = z.z;
    return from_matrix(m);
}

Pose interpolate(const Pose& a, const Pose& b, double s) {
    return {a.position_m + (b.position_m - a.position_m) * s, slerp(a.orientation, b.orientation, s)};
}

} // namespace obscura
