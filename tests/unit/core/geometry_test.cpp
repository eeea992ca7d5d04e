// SPDX-License-Identifier: Apache-2.0
#include "core/geometry.hpp"
#include "core/philox.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace geometry_test {

using namespace obscura;
using Catch::Matchers::WithinAbs;

namespace {

void check_close(Vec3 a, Vec3 b, double tolerance = 1e-14) {
    CHECK_THAT(a.x, WithinAbs(b.x, tolerance));
    CHECK_THAT(a.y, WithinAbs(b.y, tolerance));
    CHECK_THAT(a.z, WithinAbs(b.z, tolerance));
}

Quat random_quat(std::uint32_t n) {
    const auto w = philox4x32({n, 0, 0, 0}, {1, 2});
    return normalized(Quat{uniform_double(w[0]) - 0.5, uniform_double(w[1]) - 0.5, uniform_double(w[2]) - 0.5,
                           uniform_double(w[3]) - 0.5});
}

} // namespace

TEST_CASE("a quarter turn about z takes x to y") {
    check_close(rotate(axis_angle({0, 0, 5}, std::numbers::pi / 2), {1, 0, 0}), {0, 1, 0});
}

TEST_CASE("quaternion, matrix and composition agree") {
    for (std::uint32_t n = 0; n < 200; ++n) {
        const Quat a = random_quat(n);
        const Quat b = random_quat(n + 1000);
        const Vec3 v{1, -2, 0.5};
        check_close(to_matrix(a) * v, rotate(a, v));
        check_close(rotate(a * b, v), rotate(a, rotate(b, v)));
        check_close(rotate(conjugate(a), rotate(a, v)), v);
        const Quat back = from_matrix(to_matrix(a));
        CHECK_THAT(std::abs(dot(a, back)), WithinAbs(1, 1e-14));
        CHECK(back.w >= 0);
    }
}

TEST_CASE("slerp turns at a constant rate and takes the short way") {
    const Quat a = axis_angle({1, 1, 0}, 0.2);
    for (const double angle : {1e-9, 0.3, 2.0, 3.0}) {
        const Quat b = axis_angle({1, 1, 0}, 0.2 + angle);
        const Quat minus_b{-b.w, -b.x, -b.y, -b.z};
        for (const double s : {0.0, 0.25, 0.5, 1.0}) {
            const Quat expected = axis_angle({1, 1, 0}, 0.2 + s * angle);
            CHECK_THAT(std::abs(dot(slerp(a, b, s), expected)), WithinAbs(1, 1e-14));
            CHECK_THAT(std::abs(dot(slerp(a, minus_b, s), expected)), WithinAbs(1, 1e-14));
        }
    }
}

TEST_CASE("look_along puts the boresight on z and up against y") {
    const Quat q = look_along({0, 0, -3}, {0, 1, 0.4});
    check_close(rotate(q, {0, 0, 1}), {0, 0, -1});
    check_close(rotate(q, {0, -1, 0}), {0, 1, 0});
    check_close(rotate(q, {1, 0, 0}), cross({0, 0, -1}, {0, 1, 0}));
    CHECK_THROWS_AS(look_along({0, 0, 1}, {0, 0, 2}), std::invalid_argument);
    CHECK_THROWS_AS(look_along({0, 0, 0}, {0, 1, 0}), std::invalid_argument);
    CHECK_THROWS_AS(look_along({0, 0, NAN}, {0, 1, 0}), std::invalid_argument);
}

TEST_CASE("to_parent and to_local undo each other") {
    const Pose pose{{1e9, -2e9, 3}, random_quat(7)};
    check_close(to_local(pose, to_parent(pose, {1, 2, 3})), {1, 2, 3}, 1e-6);
    const Pose middle = interpolate({{0, 0, 0}, {}}, {{2, 4, 6}, axis_angle({0, 0, 1}, 1)}, 0.5);
    check_close(middle.position_m, {1, 2, 3});
    CHECK_THAT(dot(middle.orientation, axis_angle({0, 0, 1}, 0.5)), WithinAbs(1, 1e-14));
}

TEST_CASE("an orthonormal basis is right-handed for any direction") {
    for (const Vec3 n :
         {Vec3{0, 0, 1}, Vec3{0, 0, -1}, normalized(Vec3{1, -2, 3}), normalized(Vec3{1e-9, 0, -1})}) {
        Vec3 u;
        Vec3 v;
        orthonormal_basis(n, u, v);
        check_close(cross(u, v), n);
        CHECK_THAT(dot(u, n), WithinAbs(0, 1e-14));
        CHECK_THAT(length(u), WithinAbs(1, 1e-14));
    }
}

} // namespace geometry_test
