// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/frame_names.hpp"

#include "core/error.hpp"
#include "core/units.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

namespace obscura::ephemeris {
namespace {

constexpr double arcsec = std::numbers::pi / 648000;

Vec3 axis_vector(int axis) {
    return {axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0, axis == 3 ? 1.0 : 0.0};
}

/// Rotation of coordinates by [angle]_axis in NAIF's notation: that of the axes, hence the inverse of a
/// rotation of vectors.
Quat coordinates(double angle_rad, int axis) {
    return axis_angle(axis_vector(axis), -angle_rad);
}

struct Turn {
    double arcseconds = 0;
    int axis = 0; ///< 0: no rotation
};
/// Inertial frame: rotations that take coordinates in `base` to coordinates in it, the first first.
struct Inertial {
    int id;
    std::string_view name, base;
    std::array<Turn, 3> turns;
};
/// As in SPICE: Lieske (1979), Astron. Astrophys. 73, 282 for B1950; the equinox correction of Fricke (1982)
/// for FK4; Blaauw et al. (1960) for the galactic system; the obliquity of the IAU (1976).
constexpr std::array inertial_frames{
    Inertial{1, "J2000", "", {}},
    Inertial{1, "ICRF", "", {}},
    Inertial{2, "B1950", "", {{{1153.04066200330, 3}, {-1002.26108439117, 2}, {1152.84248596724, 3}}}},
    Inertial{3, "FK4", "B1950", {{{0.525, 3}, {}, {}}}},
    Inertial{13, "GALACTIC", "FK4", {{{1016100, 3}, {225360, 1}, {1177200, 3}}}},
    Inertial{17, "ECLIPJ2000", "", {{{84381.448, 1}, {}, {}}}},
};

struct BodyFixed {
    int id;
    std::string_view name;
    int class_id;
};
/// Frames of binary PCK files that have well-known ids, and IAU_ frames with theirs.
constexpr std::array body_frames{
    BodyFixed{13000, "ITRF93", 3000},         BodyFixed{31006, "MOON_PA_DE421", 31006},
    BodyFixed{31008, "MOON_PA_DE440", 31008}, BodyFixed{10010, "IAU_SUN", 10},
    BodyFixed{10011, "IAU_MERCURY", 199},     BodyFixed{10012, "IAU_VENUS", 299},
    BodyFixed{10013, "IAU_EARTH", 399},       BodyFixed{10014, "IAU_MARS", 499},
    BodyFixed{10015, "IAU_JUPITER", 599},     BodyFixed{10016, "IAU_SATURN", 699},
    BodyFixed{10017, "IAU_URANUS", 799},      BodyFixed{10018, "IAU_NEPTUNE", 899},
    BodyFixed{10019, "IAU_PLUTO", 999},       BodyFixed{10020, "IAU_MOON", 301},
};

/// Mean Earth/polar axis frames of the Moon, from the principal axes: arcseconds about z, y, x. Williams,
/// Boggs and Folkner (2008), JPL IOM 335-JW,DB,WF-20080314-001; Park et al. (2021), Astron. J. 161, 105.
struct MeanEarth {
    int id;
    std::string_view name, base;
    std::array<double, 3> zyx;
};
constexpr std::array mean_earth_frames{
    MeanEarth{31007, "MOON_ME_DE421", "MOON_PA_DE421", {67.92, 78.56, 0.30}},
    MeanEarth{31009, "MOON_ME_DE440_ME421", "MOON_PA_DE440", {67.8526, 78.6944, 0.2785}},
};

double unit_of(const std::string& place, const std::string& name) {
    struct Unit {
        std::string_view name;
        double rad;
    };
    constexpr std::array units{Unit{"DEGREES", degree},          Unit{"RADIANS", 1},
                               Unit{"ARCMINUTES", degree / 60},  Unit{"ARCSECONDS", degree / 3600},
                               Unit{"HOURANGLE", 15 * degree},   Unit{"MINUTEANGLE", degree / 4},
                               Unit{"SECONDANGLE", degree / 240}};
    for (const Unit& unit : units)
        if (unit.name == name) return unit.rad;
    throw InputError(fmt::format(
        "{}: angles in '{}', allowed DEGREES, RADIANS, ARCMINUTES, ARCSECONDS, HOURANGLE, MINUTEANGLE, SECONDANGLE",
        place, name));
}

/// Variable of a frame, by id or else by name.
class FrameVariables {
public:
    FrameVariables(const KernelPool& pool, const char* prefix, int id, const std::string& name)
        : pool_(pool),
          by_id_(fmt::format("{}_{}_", prefix, id)),
          by_name_(fmt::format("{}_{}_", prefix, name)) {}

    [[nodiscard]] std::string key(const char* item) const {
        return pool_.find(by_id_ + item) == nullptr && pool_.find(by_name_ + item) != nullptr
                   ? by_name_ + item
                   : by_id_ + item;
    }

private:
    const KernelPool& pool_;
    std::string by_id_, by_name_;
};

/// Rotation of a fixed-offset frame to the one it is relative to.
Quat offset_rotation(const KernelPool& pool, const FrameVariables& of, const std::string& place) {
    const std::string spec = kernel_name(pool.string(of.key("SPEC")).value_or(""));
    if (spec == "MATRIX") {
        // By columns; takes coordinates in the frame to the other one.
        const auto m = pool.numbers(of.key("MATRIX"), 9, 9);
        if (m.empty()) throw InputError(fmt::format("{}: {} is missing", place, of.key("MATRIX")));
        Mat3 matrix;
        for (std::size_t i = 0; i < 9; ++i)
            matrix.m[i % 3][i / 3] = m[i];
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) {
                double product = 0;
                for (int k = 0; k < 3; ++k)
                    product += matrix.m[k][a] * matrix.m[k][b];
                if (!(std::abs(product - (a == b ? 1 : 0)) < 1e-3))
                    throw InputError(
                        fmt::format("{}: not a rotation matrix", pool.find(of.key("MATRIX"))->place));
            }
        const Vec3 x{matrix.m[0][0], matrix.m[1][0], matrix.m[2][0]},
            y{matrix.m[0][1], matrix.m[1][1], matrix.m[2][1]},
            z{matrix.m[0][2], matrix.m[1][2], matrix.m[2][2]};
        if (dot(cross(x, y), z) < 0)
            throw InputError(
                fmt::format("{}: a reflection, not a rotation", pool.find(of.key("MATRIX"))->place));
        return normalized(from_matrix(matrix));
    }
    if (spec == "ANGLES") {
        // Coordinates in the other frame: [angle 1]_axis1 [angle 2]_axis2 [angle 3]_axis3 times those in the
        // frame.
        const auto angles = pool.numbers(of.key("ANGLES"), 3, 3);
        const auto axes = pool.numbers(of.key("AXES"), 3, 3);
        if (angles.empty() || axes.empty())
            throw InputError(
                fmt::format("{}: {} and {} are needed", place, of.key("ANGLES"), of.key("AXES")));
        const double unit = unit_of(place, kernel_name(pool.string(of.key("UNITS")).value_or("RADIANS")));
        Quat q;
        for (std::size_t i = 0; i < 3; ++i) {
            if (axes[i] != 1 && axes[i] != 2 && axes[i] != 3)
                throw InputError(
                    fmt::format("{}: axis {}, allowed 1, 2, 3", pool.find(of.key("AXES"))->place, axes[i]));
            q = q * coordinates(angles[i] * unit, static_cast<int>(axes[i]));
        }
        return q;
    }
    if (spec == "QUATERNION") {
        const auto q = pool.numbers(of.key("Q"), 4, 4);
        if (q.empty()) throw InputError(fmt::format("{}: {} is missing", place, of.key("Q")));
        const Quat quaternion{q[0], q[1], q[2], q[3]};
        if (!(std::abs(norm(quaternion) - 1) < 1e-3))
            throw InputError(
                fmt::format("{}: length {}, 1 is expected", pool.find(of.key("Q"))->place, norm(quaternion)));
        return normalized(quaternion);
    }
    throw InputError(
        fmt::format("{}: {} is '{}', allowed MATRIX, ANGLES, QUATERNION", place, of.key("SPEC"), spec));
}

std::optional<FrameDefinition> kernel_frame(const KernelPool& pool, const std::string& name) {
    const std::string key = "FRAME_" + name;
    const auto id = pool.integer(key);
    if (!id) return std::nullopt;
    const std::string& place = pool.find(key)->place;
    const FrameVariables of(pool, "FRAME", *id, name);
    const auto frame_class = pool.integer(of.key("CLASS"));
    if (!frame_class) throw InputError(fmt::format("{}: {} is missing", place, of.key("CLASS")));
    FrameDefinition frame{
        .name = name, .id = *id, .class_id = pool.integer(of.key("CLASS_ID")).value_or(*id)};
    switch (*frame_class) {
    case 2:
        frame.kind = FrameDefinition::Class::body;
        return frame;
    case 3:
        frame.kind = FrameDefinition::Class::attitude;
        return frame;
    case 4: {
        frame.kind = FrameDefinition::Class::fixed;
        const FrameVariables offset(pool, "TKFRAME", *id, name);
        const auto base = pool.string(offset.key("RELATIVE"));
        if (!base) throw InputError(fmt::format("{}: {} is missing", place, offset.key("RELATIVE")));
        frame.base = kernel_name(*base);
        frame.to_base = offset_rotation(pool, offset, place);
        return frame;
    }
    default: {
        const char* const what = *frame_class == 1   ? "inertial"
                                 : *frame_class == 5 ? "dynamic"
                                 : *frame_class == 6 ? "switch"
                                                     : "unknown";
        throw InputError(fmt::format("{}: frame of class {} ({}), allowed 2 (PCK), 3 (CK), 4 (fixed offset)",
                                     place, *frame_class, what));
    }
    }
}

} // namespace

FrameDefinition find_frame(const KernelPool& pool, const BodyNames& bodies, std::string_view text) {
    const std::string name = kernel_name(text);
    for (const Inertial& frame : inertial_frames) {
        if (frame.name != name) continue;
        Quat q;
        for (const Turn& turn : frame.turns)
            if (turn.axis != 0) q = coordinates(turn.arcseconds * arcsec, turn.axis) * q;
        return {.name = name, .id = frame.id, .to_base = conjugate(q), .base = std::string(frame.base)};
    }
    if (const auto frame = kernel_frame(pool, name)) return *frame;
    for (const BodyFixed& frame : body_frames)
        if (frame.name == name)
            return {.name = name,
                    .id = frame.id,
                    .kind = FrameDefinition::Class::body,
                    .class_id = frame.class_id};
    for (const MeanEarth& frame : mean_earth_frames) {
        if (frame.name != name) continue;
        const Quat q = coordinates(frame.zyx[0] * arcsec, 3) * coordinates(frame.zyx[1] * arcsec, 2) *
                       coordinates(frame.zyx[2] * arcsec, 1);
        return {.name = name,
                .id = frame.id,
                .kind = FrameDefinition::Class::fixed,
                .to_base = q,
                .base = std::string(frame.base)};
    }
    if (name.starts_with("IAU_")) {
        const std::string body = name.substr(4);
        std::string spaced = body;
        for (char& c : spaced)
            if (c == '_') c = ' ';
        for (const std::string& candidate : {body, spaced})
            if (const auto id = bodies.id(candidate))
                return {.name = name, .kind = FrameDefinition::Class::body, .class_id = *id};
    }
    throw InputError(fmt::format(
        "frame {}: unknown: neither J2000, ECLIPJ2000, IAU_ and a body, nor a frame of a loaded frame kernel (FK)",
        name));
}

std::string frame_name(const KernelPool& pool, int id) {
    for (const Inertial& frame : inertial_frames)
        if (frame.id == id) return std::string(frame.name);
    if (const auto name = pool.string(fmt::format("FRAME_{}_NAME", id))) return kernel_name(*name);
    for (const BodyFixed& frame : body_frames)
        if (frame.id == id) return std::string(frame.name);
    for (const MeanEarth& frame : mean_earth_frames)
        if (frame.id == id) return std::string(frame.name);
    return {};
}

} // namespace obscura::ephemeris
