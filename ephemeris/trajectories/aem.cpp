// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/trajectories/aem.hpp"

#include "ephemeris/trajectories/kvn.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace obscura::ephemeris {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double fastest_rad_s = 1e6 * degree;
constexpr std::array<std::string_view, 18> keywords{
    "OBJECT_NAME",          "OBJECT_ID",          "CENTER_NAME",       "REF_FRAME_A",
    "REF_FRAME_B",          "ATTITUDE_DIR",       "TIME_SYSTEM",       "START_TIME",
    "ATTITUDE_TYPE",        "USEABLE_START_TIME", "USEABLE_STOP_TIME", "STOP_TIME",
    "ANGVEL_FRAME",         "RATE_FRAME",         "QUATERNION_TYPE",   "INTERPOLATION_METHOD",
    "INTERPOLATION_DEGREE", "EULER_ROT_SEQ"};

/// What the numbers of a line are.
struct Layout {
    enum class Rates : std::uint8_t { none, quaternion_derivative, angular_velocity };
    Rates rates = Rates::none;
    bool scalar_first = false;
    bool object_is_b = true; ///< frame B is the object's, A the one it is related to
    bool b_to_a = false;     ///< the quaternion is of B2A
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

Layout layout_of(const KvnBlock& meta, const std::string& a, const std::string& b) {
    Layout layout;
    constexpr std::array<std::string_view, 4> types{"QUATERNION", "QUATERNION/DERIVATIVE", "QUATERNION/RATE",
                                                    "QUATERNION/ANGVEL"};
    const std::string type = meta.choice("ATTITUDE_TYPE", types);
    layout.rates = type == types[0]   ? Layout::Rates::none
                   : type == types[1] ? Layout::Rates::quaternion_derivative
                                      : Layout::Rates::angular_velocity;
    constexpr std::array<std::string_view, 2> orders{"LAST", "FIRST"}, directions{"A2B", "B2A"};
    layout.scalar_first = meta.has("QUATERNION_TYPE") && meta.choice("QUATERNION_TYPE", orders) == "FIRST";
    layout.b_to_a = meta.has("ATTITUDE_DIR") && meta.choice("ATTITUDE_DIR", directions) == "B2A";
    layout.object_is_b = is_object_b(a, b);
    if (layout.rates != Layout::Rates::angular_velocity) return layout;
    if (layout.b_to_a) meta.fail("ATTITUDE_DIR", "B2A, allowed with angular velocities is A2B");
    const char* keyword = meta.has("RATE_FRAME") ? "RATE_FRAME" : "ANGVEL_FRAME";
    const std::array<std::string_view, 4> axes{"REF_FRAME_A", "REF_FRAME_B", a, b};
    const std::string frame = meta.choice(keyword, axes);
    layout.rates_in_a = frame == axes[0] || frame == a;
    return layout;
}

Interpolation interpolation_of(const KvnBlock& meta) {
    if (!meta.has("INTERPOLATION_METHOD")) return {};
    constexpr std::array<std::string_view, 2> methods{"LINEAR", "LAGRANGE"};
    if (meta.choice("INTERPOLATION_METHOD", methods) == methods[0]) return {};
    return {Interpolation::Method::lagrange, degree_of(meta, "INTERPOLATION_DEGREE", 7)};
}

/// Four numbers of a line as a quaternion of the direction A2B.
Quat quaternion_of(const double* n, const Layout& layout) {
    return layout.scalar_first ? Quat{n[0], n[1], n[2], n[3]} : Quat{n[3], n[0], n[1], n[2]};
}

void add_sample(const KvnReader& reader, const KvnLine& line, const KvnSample& sample, const Layout& layout,
                PathSegment& segment) {
    using Rates = Layout::Rates;
    const std::vector<double>& n = sample.numbers;
    const std::size_t wanted = layout.rates == Rates::none               ? 4
                               : layout.rates == Rates::angular_velocity ? 7
                                                                         : 8;
    if (n.size() != wanted)
        reader.fail(line.number,
                    fmt::format("{} numbers after the time, allowed for this ATTITUDE_TYPE are {}", n.size(),
                                wanted));
    const Quat given = quaternion_of(n.data(), layout);
    if (!(std::abs(norm(given) - 1) <= 1e-3))
        reader.fail(line.number, fmt::format("|q| = {:.6g}, a unit quaternion is wanted", norm(given)));
    // A frame rotation from A to B gives components in B; as an operator on vectors the same quaternion turns
    // B's axes into A's, which is the orientation of B in A.
    const bool turned = layout.object_is_b == layout.b_to_a;
    Quat q = normalized(turned ? conjugate(given) : given);
    // q and -q are the same attitude: neighbours get the nearer signs, for polynomials through them.
    if (!segment.orientation.empty() && dot(segment.orientation.back(), q) < 0) q = {-q.w, -q.x, -q.y, -q.z};
    segment.epochs.push_back(sample.epoch);
    segment.orientation.push_back(q);
    if (layout.rates == Rates::quaternion_derivative) {
        const Quat stated = quaternion_of(n.data() + 4, layout);
        const Quat rate =
            conjugate(turned ? conjugate(given) : given) * (turned ? conjugate(stated) : stated);
        segment.rate_rad_s.push_back(Vec3{rate.x, rate.y, rate.z} * 2.0);
    } else if (layout.rates == Rates::angular_velocity) {
        // Of B relative to A; of the object in its own axes.
        Vec3 rate = Vec3{n[4], n[5], n[6]} * (layout.object_is_b ? degree : -degree);
        if (layout.rates_in_a == layout.object_is_b) rate = rotate(conjugate(q), rate);
        segment.rate_rad_s.push_back(rate);
    }
    if (!segment.rate_rad_s.empty() && !(length(segment.rate_rad_s.back()) <= fastest_rad_s))
        reader.fail(line.number, "the attitude turns by more than 1e6 deg/s");
}

} // namespace

PathFile parse_aem(const std::string& text, const std::string& name, const LeapSeconds& leap_seconds) {
    KvnReader reader(text, name);
    constexpr std::array<std::string_view, 2> versions{"1", "2"};
    read_header(reader, "CCSDS_AEM_VERS", versions);
    PathFile file;
    for (bool more = true; more;) {
        const std::size_t begin = reader.line();
        const KvnBlock meta(reader, "META_STOP", keywords);
        const std::string a = meta.name("REF_FRAME_A"), b = meta.name("REF_FRAME_B");
        const TimeScale scale = time_scale_of(meta);
        const Layout layout = layout_of(meta, a, b);
        const PathFrames frames{meta.required("OBJECT_NAME"), "", layout.object_is_b ? a : b,
                                layout.object_is_b ? b : a};
        const KvnSpan span = span_of(meta, scale, leap_seconds);
        PathSegment segment;
        segment.interpolation = interpolation_of(meta);
        KvnLine line;
        if (!reader.next(line) || line.keyword != "DATA_START")
            reader.fail(reader.line(), "DATA_START is wanted here");
        while (reader.next(line) && line.keyword != "DATA_STOP") {
            if (!line.keyword.empty())
                reader.fail(line.number, fmt::format("\"{}\" before DATA_STOP", shown(line.keyword)));
            add_sample(reader, line, sample_of(reader, line, scale, leap_seconds, span, last_epoch(segment)),
                       layout, segment);
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
