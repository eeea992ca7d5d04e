// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/sampled_pose_path.hpp"

#include "core/error.hpp"
#include "core/io/text_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>

namespace obscura::scene {
namespace {

class SampledPosePath final : public PosePath {
public:
    explicit SampledPosePath(PathParts parts) : parts_(std::move(parts)) {}

    [[nodiscard]] Pose at(double time_s) const noexcept override {
        Pose pose = parts_.constant;
        if (parts_.positions) pose.position_m = parts_.positions->position_m(time_s);
        if (parts_.attitudes) pose.orientation = parts_.attitudes->orientation(time_s);
        return pose;
    }
    [[nodiscard]] Vec3 velocity_m_s(double time_s) const noexcept override {
        return parts_.positions ? parts_.positions->velocity_m_s(time_s) : Vec3{};
    }
    [[nodiscard]] PoseAges ages(double time_s) const noexcept override {
        return {parts_.positions ? parts_.positions->age_s(time_s) : 0,
                parts_.attitudes ? parts_.attitudes->age_s(time_s) : 0};
    }
    [[nodiscard]] std::vector<double> times_s() const override {
        std::vector<double> all;
        for (const auto* part : {&parts_.positions, &parts_.attitudes}) {
            if (!*part) continue;
            const std::vector<double> times = (*part)->times_s();
            std::vector<double> both;
            std::set_union(all.begin(), all.end(), times.begin(), times.end(), std::back_inserter(both));
            all = std::move(both);
        }
        return all;
    }
    [[nodiscard]] std::vector<double> attitude_instants_s() const override {
        std::vector<double> times;
        if (parts_.attitudes) times = parts_.attitudes->times_s();
        return times.size() == 1 ? times : std::vector<double>{};
    }

private:
    PathParts parts_;
};

} // namespace

PathFormat path_format(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw ConfigError(fmt::format("{}: cannot be read", file.string()));
    // Comments may stand before the version, and a table has none of these words in its header.
    std::string beginning(4096, '\0');
    in.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
    beginning.resize(static_cast<std::size_t>(in.gcount()));
    if (beginning.find("CCSDS_AEM_VERS") != std::string::npos) return PathFormat::aem;
    beginning = without_byte_order_mark(beginning);
    const std::size_t first = beginning.find_first_not_of(" \t\r\n");
    const bool xml = first != std::string::npos && beginning[first] == '<';
    // The reader of messages says what is wrong with XML.
    return xml || beginning.find("CCSDS_OEM_VERS") != std::string::npos ? PathFormat::oem : PathFormat::csv;
}

ephemeris::PathFile path_of_table(const std::filesystem::path& file, const std::vector<TimedPose>& samples) {
    ephemeris::PathSegment segment;
    // Longer than any mission; beyond, nanoseconds do not fit.
    constexpr double max_s = 9e9;
    for (const TimedPose& sample : samples) {
        const ephemeris::Epoch at{std::llround(std::clamp(sample.time_s, -max_s, max_s) * 1e9)};
        if (!segment.epochs.empty() && at <= segment.epochs.back())
            throw ConfigError(
                fmt::format("{}: time_s: {} is less than 1 ns after the row before, or beyond 9e9 s",
                            file.string(), sample.time_s));
        segment.epochs.push_back(at);
        segment.position_m.push_back(sample.pose.position_m);
        segment.orientation.push_back(sample.pose.orientation);
    }
    segment.start = segment.epochs.front();
    segment.stop = segment.epochs.back();
    ephemeris::PathFile path;
    path.segments.push_back(std::move(segment));
    return path;
}

std::shared_ptr<const PosePath> make_path(PathParts parts) {
    return std::make_shared<const SampledPosePath>(std::move(parts));
}

std::shared_ptr<const PosePath> path_of_samples(const std::vector<TimedPose>& samples) {
    if (samples.size() == 1) return make_path({.constant = samples.front().pose});
    const ephemeris::SampledPath path(path_of_table("trajectory", samples), {}, 0);
    return make_path({.positions = path, .attitudes = path, .constant = {}});
}

std::vector<TimedPose> samples_of(const PosePath& path) {
    std::vector<TimedPose> samples;
    for (const double time_s : path.times_s())
        samples.push_back({time_s, path.at(time_s)});
    if (samples.empty()) samples.push_back({0, path.at(0)});
    return samples;
}

} // namespace obscura::scene
