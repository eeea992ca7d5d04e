// SPDX-License-Identifier: Apache-2.0
// Double-precision vectors, rotations and poses.
#pragma once

#include <cmath>

namespace obscura {
/// Vector of three doubles; names carry the unit (`position_m`).
struct Vec3 {
    double x = 0, y = 0, z = 0;

    constexpr bool operator==(const Vec3&) const = default;
};

constexpr Vec3 operator+(Vec3 a, Vec3 b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
constexpr Vec3 operator-(Vec3 a, Vec3 b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
constexpr Vec3 operator-(Vec3 a) {
    return {-a.x, -a.y, -a.z};
}
constexpr Vec3 operator*(Vec3 a, double s) {
    return {a.x * s, a.y * s, a.z * s};
}
constexpr Vec3 operator*(double s, Vec3 a) {
    return a * s;
}
constexpr Vec3 operator/(Vec3 a, double s) {
    return {a.x / s, a.y / s, a.z / s};
}
constexpr double dot(Vec3 a, Vec3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
constexpr Vec3 cross(Vec3 a, Vec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
constexpr double length_squared(Vec3 a) {
    return dot(a, a);
}
inline double length(Vec3 a) {
    return std::sqrt(dot(a, a));
}
inline Vec3 normalized(Vec3 a) {
    return a / length(a);
}
inline bool is_finite(Vec3 a) {
    return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// Two unit vectors that complete the unit vector `n` to a right-handed basis (u, v, n).
/// Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1), 2017.
inline void orthonormal_basis(Vec3 n, Vec3& u, Vec3& v) {
    const double sign = std::copysign(1.0, n.z);
    const double a = -1.0 / (sign + n.z);
    const double b = n.x * n.y * a;
    u = {1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x};
    v = {b, sign + n.y * n.y * a, -n.y};
}

/// Rotation matrix, row-major.
struct Mat3 {
    double m[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
};

constexpr Vec3 operator*(const Mat3& a, Vec3 v) {
    return {a.m[0][0] * v.x + a.m[0][1] * v.y + a.m[0][2] * v.z,
            a.m[1][0] * v.x + a.m[1][1] * v.y + a.m[1][2] * v.z,
            a.m[2][0] * v.x + a.m[2][1] * v.y + a.m[2][2] * v.z};
}

constexpr Mat3 transposed(const Mat3& a) {
    Mat3 t;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            t.m[r][c] = a.m[c][r];
    return t;
}

/// Unit quaternion, scalar first, active: `rotate(q, v)` rotates v. The orientation of a body or camera is
/// the rotation that takes vectors from its own frame to its parent (inertial) frame, everywhere in Obscura.
struct Quat {
    double w = 1, x = 0, y = 0, z = 0;

    constexpr bool operator==(const Quat&) const = default;
};

constexpr Quat conjugate(Quat q) {
    return {q.w, -q.x, -q.y, -q.z};
}
constexpr double dot(Quat a, Quat b) {
    return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
}
inline double norm(Quat q) {
    return std::sqrt(dot(q, q));
}
Quat normalized(Quat q);
/// Hamilton product: `rotate(a * b, v) == rotate(a, rotate(b, v))`.
constexpr Quat operator*(Quat a, Quat b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
constexpr Vec3 rotate(Quat q, Vec3 v) {
    const Vec3 u{q.x, q.y, q.z};
    const Vec3 t = 2.0 * cross(u, v);
    return v + q.w * t + cross(u, t);
}
/// Rotation by `angle_rad` about `axis` (any length but zero), right-handed.
Quat axis_angle(Vec3 axis, double angle_rad);
Mat3 to_matrix(Quat q);
/// Inverse of to_matrix; w >= 0 in the result. The matrix must be a rotation.
Quat from_matrix(const Mat3& m);
/// Spherical linear interpolation along the shorter arc; s in [0,1].
Quat slerp(Quat a, Quat b, double s);
/// The camera orientation whose boresight (+z) is `boresight` and whose -y ("up" in the image, as image rows
/// grow along +y) lies in the half plane of `up`. Camera axes: x right, y down, z boresight. Throws
/// std::invalid_argument when the two are parallel or zero.
Quat look_along(Vec3 boresight, Vec3 up);

/// Position (metres) and attitude of a body or camera in its parent frame.
struct Pose {
    Vec3 position_m;
    Quat orientation;

    constexpr bool operator==(const Pose&) const = default;
};

/// Transforms a point from the body's own frame to the parent frame, and back.
inline Vec3 to_parent(const Pose& p, Vec3 local_m) {
    return p.position_m + rotate(p.orientation, local_m);
}
inline Vec3 to_local(const Pose& p, Vec3 parent_m) {
    return rotate(conjugate(p.orientation), parent_m - p.position_m);
}
/// Interpolates linearly in position and by slerp in attitude.
Pose interpolate(const Pose& a, const Pose& b, double s);

} // namespace obscura
