// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/trajectories/oem.hpp"

#include "core/pose_range.hpp"
#include "ephemeris/trajectories/kvn.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::ephemeris {
namespace {

constexpr std::array<std::string_view, 12> oem_keywords{
    "OBJECT_NAME",       "OBJECT_ID",   "CENTER_NAME",   "REF_FRAME",
    "REF_FRAME_EPOCH",   "TIME_SYSTEM", "START_TIME",    "USEABLE_START_TIME",
    "USEABLE_STOP_TIME", "STOP_TIME",   "INTERPOLATION", "INTERPOLATION_DEGREE"};

Interpolation interpolation_of(const KvnBlock& meta) {
    // Velocities are in every line, so that a cubic through two samples is always possible.
    if (!meta.has("INTERPOLATION")) return {Interpolation::Method::hermite, 3};
    constexpr std::array<std::string_view, 3> methods{"LINEAR", "LAGRANGE", "HERMITE"};
    const std::string method = meta.choice("INTERPOLATION", methods);
    if (method == methods[0]) return {Interpolation::Method::linear, 1};
    if (method == methods[1])
        return {Interpolation::Method::lagrange, degree_of(meta, "INTERPOLATION_DEGREE", 7)};
    return {Interpolation::Method::hermite, degree_of(meta, "INTERPOLATION_DEGREE", 3)};
}

void add_sample(const KvnReader& reader, const KvnLine& line, const KvnSample& sample, PathSegment& segment) {
    const std::vector<double>& n = sample.numbers;
    if (n.size() != 6 && n.size() != 9)
        reader.fail(
            line.number,
            fmt::format(
                "{} numbers after the time, allowed are 6 (x y z in km, vx vy vz in km/s), or 9 with accelerations",
                n.size()));
    const Vec3 position_m = Vec3{n[0], n[1], n[2]} * 1e3;
    const Vec3 velocity_m_s = Vec3{n[3], n[4], n[5]} * 1e3;
    if (const auto why = refusal_of_position(position_m)) reader.fail(line.number, *why);
    if (const auto why = refusal_of_velocity(velocity_m_s)) reader.fail(line.number, *why);
    segment.epochs.push_back(sample.epoch);
    segment.position_m.push_back(position_m);
    segment.velocity_m_s.push_back(velocity_m_s);
}

void skip_covariance(KvnReader& reader, std::size_t from) {
    KvnLine line;
    while (reader.next(line))
        if (line.keyword == "COVARIANCE_STOP") return;
    reader.fail(from, "COVARIANCE_START without COVARIANCE_STOP");
}

} // namespace

PathFile parse_oem(const std::string& text, const std::string& name, const LeapSeconds& leap_seconds) {
    KvnReader reader(text, name, "oem");
    constexpr std::array<std::string_view, 3> versions{"1", "2", "3"};
    read_header(reader, "CCSDS_OEM_VERS", versions);
    PathFile file;
    for (bool more = true; more;) {
        const std::size_t begin = reader.line();
        const KvnBlock meta(reader, "META_STOP", oem_keywords);
        const PathFrames frames{meta.required("OBJECT_NAME"), meta.name("CENTER_NAME"),
                                meta.name("REF_FRAME"), ""};
        const TimeScale scale = time_scale_of(meta);
        const KvnSpan span = span_of(meta, scale, leap_seconds);
        PathSegment segment;
        segment.interpolation = interpolation_of(meta);
        KvnLine line;
        while ((more = reader.next(line)) && line.keyword != "META_START") {
            if (line.keyword == "COVARIANCE_START") {
                skip_covariance(reader, line.number);
                continue;
            }
            if (!line.keyword.empty())
                reader.fail(line.number, fmt::format("\"{}\" among the samples", shown(line.keyword)));
            add_sample(reader, line, sample_of(reader, line, scale, leap_seconds, span, last_epoch(segment)),
                       segment);
        }
        finish_segment(reader, begin, span, segment);
        append_segment(reader, begin, file, frames, std::move(segment));
    }
    return file;
}

PathFile read_oem(const std::filesystem::path& file, const LeapSeconds& leap_seconds) {
    return parse_oem(read_message(file), file.string(), leap_seconds);
}

} // namespace obscura::ephemeris
