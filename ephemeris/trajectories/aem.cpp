// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/trajectories/aem.hpp"

#include "core/pose_range.hpp"
#include "core/units.hpp"
#include "ephemeris/trajectories/kvn.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace obscura::ephemeris {
namespace {

constexpr std::array<std::string_view, 18> aem_keywords{
    "OBJECT_NAME",          "OBJECT_ID",          "CENTER_NAME",       "REF_FRAME_A",
    "REF_FRAME_B",          "ATTITUDE_DIR",       "TIME_SYSTEM",       "START_TIME",
    "ATTITUDE_TYPE",        "USEABLE_START_TIME", "USEABLE_STOP_TIME", "STOP_TIME",
    "ANGVEL_FRAME",         "RATE_FRAME",         "QUATERNION_TYPE",   "INTERPOLATION_METHOD",
    "INTERPOLATION_DEGREE", "EULER_ROT_SEQ"};

/// What the numbers of a line are.
struct Layout {
    enum class Attitude : std::uint8_t { quaternion, euler, spin };
    enum class Rates : std::uint8_t { none, unused, derivative, angular_velocity };
    Attitude attitude = Attitude::quaternion;
    Rates rates = Rates::none;
    std::array<Vec3, 3> euler_axes{}; ///< of the first, second and third angle
    bool scalar_first = false;
    bool object_is_b = true; ///< frame B is the object's, A the one it is related to
    bool b_to_a = false;     ///< quaternion or angles are of B2A
    bool rates_in_a = false; ///< axes of the angular velocity
};

/// Whether the name is of axes fixed to a spacecraft or a part of it (504.0-B-2, annex B).
bool is_object_frame(std::string_view name) {
    constexpr std::array<std::string_view, 12> families{"SC_BODY",  "SC",          "INSTRUMENT", "SENSOR",
                                                        "ACTUATOR", "STARTRACKER", "AST",        "CSS",
                                                        "DSS",      "GYRO",        "IMU",        "CAMERA"};
    const std::string_view family = name.substr(0, name.find_last_not_of("_0123456789") + 1);
    return std::find(families.begin(), families.end(), family) != families.end();
}

bool is_object_b(const std::string& a, const std::string& b) {
    if (is_object_frame(a) != is_object_frame(b)) return is_object_frame(b);
    return is_inertial_frame(a) || !is_inertial_frame(b);
}

/// Axes of EULER_ROT_SEQ: "321" or "ZYX", no two neighbours alike.
std::array<Vec3, 3> euler_axes_of(const KvnBlock& meta) {
    const std::string sequence = meta.name("EULER_ROT_SEQ");
    std::array<Vec3, 3> axes;
    std::array<std::size_t, 3> used{};
    const auto refuse = [&] {
        meta.fail("EULER_ROT_SEQ",
                  fmt::format("\"{}\", allowed are three axes such as 321 or ZYX, neighbours not the same",
                              shown(sequence)));
    };
    if (sequence.size() != axes.size()) refuse();
    constexpr std::array<Vec3, 3> xyz{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    for (std::size_t i = 0; i < axes.size(); ++i) {
        const std::size_t axis =
            std::min(std::string_view("123").find(sequence[i]), std::string_view("XYZ").find(sequence[i]));
        if (axis >= xyz.size() || (i > 0 && axis == used[i - 1])) refuse();
        used[i] = axis;
        axes[i] = xyz[axis];
    }
    return axes;
}

Layout layout_of(const KvnBlock& meta, const std::string& a, const std::string& b) {
    using Attitude = Layout::Attitude;
    using Rates = Layout::Rates;
    struct Type {
        std::string_view name;
        Attitude attitude;
        Rates rates;
    };
    // Version 1 leaves open in which order the rates of EULER_ANGLE/RATE stand.
    constexpr std::array types{
        Type{"QUATERNION", Attitude::quaternion, Rates::none},
        Type{"QUATERNION/DERIVATIVE", Attitude::quaternion, Rates::derivative},
        Type{"QUATERNION/RATE", Attitude::quaternion, Rates::angular_velocity},
        Type{"QUATERNION/ANGVEL", Attitude::quaternion, Rates::angular_velocity},
        Type{"EULER_ANGLE", Attitude::euler, Rates::none},
        Type{"EULER_ANGLE/RATE", Attitude::euler, Rates::unused},
        Type{"EULER_ANGLE/DERIVATIVE", Attitude::euler, Rates::derivative},
        Type{"EULER_ANGLE/ANGVEL", Attitude::euler, Rates::angular_velocity},
        Type{"SPIN", Attitude::spin, Rates::angular_velocity},
    };
    std::array<std::string_view, types.size()> names;
    std::transform(types.begin(), types.end(), names.begin(), [](const Type& t) { return t.name; });
    const std::string type = meta.choice("ATTITUDE_TYPE", names);
    const Type& chosen =
        *std::find_if(types.begin(), types.end(), [&](const Type& t) { return t.name == type; });
    Layout layout;
    layout.attitude = chosen.attitude;
    layout.rates = chosen.rates;
    if (layout.attitude == Attitude::euler) layout.euler_axes = euler_axes_of(meta);
    constexpr std::array<std::string_view, 2> orders{"LAST", "FIRST"}, directions{"A2B", "B2A"};
    layout.scalar_first = meta.has("QUATERNION_TYPE") && meta.choice("QUATERNION_TYPE", orders) == "FIRST";
    layout.b_to_a = meta.has("ATTITUDE_DIR") && meta.choice("ATTITUDE_DIR", directions) == "B2A";
    layout.object_is_b = is_object_b(a, b);
    if (layout.rates != Rates::angular_velocity || layout.attitude == Attitude::spin) return layout;
    if (layout.b_to_a) meta.fail("ATTITUDE_DIR", "B2A, allowed with angular velocities is A2B");
    const char* keyword = meta.has("RATE_FRAME") ? "RATE_FRAME" : "ANGVEL_FRAME";
    const std::array<std::string_view, 4> axes{"REF_FRAME_A", "REF_FRAME_B", a, b};
    const std::string frame = meta.choice(keyword, axes);
    layout.rates_in_a = frame == axes[0] || frame == a;
    return layout;
}

Interpolation attitude_interpolation(const KvnBlock& meta, const Layout& layout) {
    if (!meta.has("INTERPOLATION_METHOD")) return {};
    constexpr std::array<std::string_view, 3> methods{"LINEAR", "LAGRANGE", "HERMITE"};
    const std::string method = meta.choice("INTERPOLATION_METHOD", methods);
    if (method == methods[0]) return {};
    if (layout.attitude == Layout::Attitude::spin)
        meta.fail("INTERPOLATION_METHOD",
                  fmt::format("{}, allowed with ATTITUDE_TYPE = SPIN is LINEAR", method));
    // Without rates Hermite's polynomial of a degree is the one through more samples.
    const bool rates =
        layout.rates == Layout::Rates::derivative || layout.rates == Layout::Rates::angular_velocity;
    return {method == methods[2] && rates ? Interpolation::Method::hermite : Interpolation::Method::lagrange,
            degree_of(meta, "INTERPOLATION_DEGREE", 7)};
}

/// Four numbers of a line as a quaternion of the direction A2B.
Quat quaternion_of(const double* n, const Layout& layout) {
    return layout.scalar_first ? Quat{n[0], n[1], n[2], n[3]} : Quat{n[3], n[0], n[1], n[2]};
}

/// Numbers of a line of each layout.
std::size_t numbers_of(const Layout& layout) {
    using Attitude = Layout::Attitude;
    using Rates = Layout::Rates;
    if (layout.attitude == Attitude::spin) return 4;
    const std::size_t attitude = layout.attitude == Attitude::euler ? 3 : 4;
    if (layout.rates == Rates::none) return attitude;
    return attitude + (layout.rates == Rates::derivative ? attitude : 3);
}

/// Adds a line of SPIN_ALPHA, SPIN_DELTA, SPIN_ANGLE, SPIN_ANGLE_VEL. The object's z axis is the spin axis;
/// the angle counts about it from where the axis' equator ascends through the xy plane of the other frame: a
/// sequence 313 of alpha + 90, 90 - delta, angle.
void add_spin(const std::vector<double>& n, PathSegment& segment) {
    const Vec3 z{0, 0, 1};
    Quat axes = axis_angle(z, (90 + n[0]) * degree) * axis_angle({1, 0, 0}, (90 - n[1]) * degree);
    if (!segment.orientation.empty() && dot(segment.orientation.back(), axes) < 0)
        axes = {-axes.w, -axes.x, -axes.y, -axes.z};
    const double rate_rad_s = n[3] * degree;
    double spin_rad = n[2] * degree;
    if (!segment.spin_rad.empty()) {
        // Whole turns between the samples by the mean of their rates.
        const auto& epochs = segment.epochs;
        const double step_s =
            static_cast<double>(epochs.back().tai_ns - epochs[epochs.size() - 2].tai_ns) * 1e-9;
        const double expected_rad =
            segment.spin_rad.back() + (segment.rate_rad_s.back().z + rate_rad_s) / 2 * step_s;
        spin_rad += 2 * std::numbers::pi * std::round((expected_rad - spin_rad) / (2 * std::numbers::pi));
    }
    segment.orientation.push_back(axes);
    segment.spin_rad.push_back(spin_rad);
    segment.rate_rad_s.push_back(z * rate_rad_s);
}

void add_attitude(const KvnReader& reader, const KvnLine& line, const KvnSample& sample, const Layout& layout,
                  PathSegment& segment) {
    using Attitude = Layout::Attitude;
    using Rates = Layout::Rates;
    const std::vector<double>& n = sample.numbers;
    if (n.size() != numbers_of(layout))
        reader.fail(line.number,
                    fmt::format("{} numbers after the time, allowed for this ATTITUDE_TYPE are {}", n.size(),
                                numbers_of(layout)));
    const bool euler = layout.attitude == Attitude::euler;
    constexpr double max_deg = 1e6;
    for (std::size_t i = 0; i < (layout.attitude == Attitude::quaternion ? 0 : 3); ++i)
        if (!(std::abs(n[i]) <= max_deg)) reader.fail(line.number, "an angle is beyond 1e6 deg");
    segment.epochs.push_back(sample.epoch);
    if (layout.attitude == Attitude::spin) {
        add_spin(n, segment);
    } else {
        std::array<Quat, 3> turns;
        for (std::size_t i = 0; i < turns.size() && euler; ++i)
            turns[i] = axis_angle(layout.euler_axes[i], n[i] * degree);
        const Quat given = euler ? turns[0] * turns[1] * turns[2] : quaternion_of(n.data(), layout);
        if (refusal_of_attitude(given))
            reader.fail(line.number, fmt::format("|q| = {:.6g}, a unit quaternion is wanted", norm(given)));
        // A frame rotation from A to B gives components in B; as an operator on vectors the same quaternion
        // turns B's axes into A's, which is the orientation of B in A.
        const bool turned = layout.object_is_b == layout.b_to_a;
        Quat q = normalized(turned ? conjugate(given) : given);
        // q and -q are the same attitude: neighbours get the nearer signs, for polynomials through them.
        if (!segment.orientation.empty() && dot(segment.orientation.back(), q) < 0)
            q = {-q.w, -q.x, -q.y, -q.z};
        segment.orientation.push_back(q);
        if (layout.rates == Rates::derivative && euler) {
            // Rate of the frame that the angles lead to relative to the other, in its axes.
            const Vec3 rate =
                (rotate(conjugate(turns[1] * turns[2]), layout.euler_axes[0]) * n[3] +
                 rotate(conjugate(turns[2]), layout.euler_axes[1]) * n[4] + layout.euler_axes[2] * n[5]) *
                degree;
            segment.rate_rad_s.push_back(turned ? -rotate(given, rate) : rate);
        } else if (layout.rates == Rates::derivative) {
            const Quat stated = quaternion_of(n.data() + 4, layout);
            const Quat rate =
                conjugate(turned ? conjugate(given) : given) * (turned ? conjugate(stated) : stated);
            segment.rate_rad_s.push_back(Vec3{rate.x, rate.y, rate.z} * 2.0);
        } else if (layout.rates == Rates::angular_velocity) {
            // Rate of B relative to A, turned into the object's rate in its own axes.
            const double* const r = n.data() + (euler ? 3 : 4);
            Vec3 rate = Vec3{r[0], r[1], r[2]} * (layout.object_is_b ? degree : -degree);
            if (layout.rates_in_a == layout.object_is_b) rate = rotate(conjugate(q), rate);
            segment.rate_rad_s.push_back(rate);
        }
    }
    if (!segment.rate_rad_s.empty())
        if (const auto why = refusal_of_rate(segment.rate_rad_s.back())) reader.fail(line.number, *why);
}

} // namespace

PathFile parse_aem(const std::string& text, const std::string& name, const LeapSeconds& leap_seconds) {
    KvnReader reader(text, name, "aem");
    constexpr std::array<std::string_view, 2> versions{"1", "2"};
    read_header(reader, "CCSDS_AEM_VERS", versions);
    PathFile file;
    for (bool more = true; more;) {
        const std::size_t begin = reader.line();
        const KvnBlock meta(reader, "META_STOP", aem_keywords);
        const std::string a = meta.name("REF_FRAME_A"), b = meta.name("REF_FRAME_B");
        const TimeScale scale = time_scale_of(meta);
        const Layout layout = layout_of(meta, a, b);
        const PathFrames frames{meta.required("OBJECT_NAME"), "", layout.object_is_b ? a : b,
                                layout.object_is_b ? b : a};
        const KvnSpan span = span_of(meta, scale, leap_seconds);
        PathSegment segment;
        segment.interpolation = attitude_interpolation(meta, layout);
        KvnLine line;
        if (!reader.next(line) || line.keyword != "DATA_START")
            reader.fail(reader.line(), "DATA_START is wanted here");
        while (reader.next(line) && line.keyword != "DATA_STOP") {
            if (!line.keyword.empty())
                reader.fail(line.number, fmt::format("\"{}\" before DATA_STOP", shown(line.keyword)));
            add_attitude(reader, line,
                         sample_of(reader, line, scale, leap_seconds, span, last_epoch(segment)), layout,
                         segment);
        }
        if (line.keyword != "DATA_STOP") reader.fail(reader.line(), "ends before DATA_STOP");
        finish_segment(reader, begin, span, segment);
        append_segment(reader, begin, file, frames, std::move(segment));
        more = reader.next(line);
        if (more && line.keyword != "META_START")
            reader.fail(line.number, "META_START is wanted here, or the end of the file");
    }
    return file;
}

PathFile read_aem(const std::filesystem::path& file, const LeapSeconds& leap_seconds) {
    return parse_aem(read_message(file), file.string(), leap_seconds);
}

} // namespace obscura::ephemeris
