// SPDX-License-Identifier: Apache-2.0
#include "instrument/link/recorded_link.hpp"

#include "core/realtime/log.hpp"

#include <fmt/format.h>

#include <map>

namespace obscura::instrument {
namespace {

std::string text_of(const FeatureValue& value) {
    return std::visit([](const auto& one) { return fmt::format("{}", one); }, value);
}

std::map<std::string, std::string> values_of(const std::vector<Feature>& features) {
    std::map<std::string, std::string> values;
    for (const Feature& feature : features)
        values[feature.name] = text_of(feature.value);
    return values;
}

} // namespace

void RecordedLink::note(std::uint32_t camera, const char* what) const {
    log_notice("instrument: {} of {}: {} of camera {}", who_, peer_, what, camera);
}

void RecordedLink::set(std::uint32_t camera, const std::string& feature, const FeatureValue& value) {
    const std::map<std::string, std::string> before = values_of(link_.features(camera));
    link_.set(camera, feature, value);
    // A setting may change others.
    for (const auto& [name, now] : values_of(link_.features(camera)))
        if (const auto old = before.find(name); old != before.end() && old->second != now)
            log_notice("instrument: {} of {}: {} of camera {}: {} -> {}", who_, peer_, name, camera,
                       old->second, now);
}

void RecordedLink::start(std::uint32_t camera) {
    link_.start(camera);
    note(camera, "start");
}

void RecordedLink::stop(std::uint32_t camera) {
    link_.stop(camera);
    note(camera, "stop");
}

void RecordedLink::begin_trigger(std::uint32_t camera) {
    link_.begin_trigger(camera);
    triggered_ = camera;
}

std::optional<TriggerResult> RecordedLink::trigger_result(double wait_s) {
    std::optional<TriggerResult> result = link_.trigger_result(wait_s);
    if (result) note(triggered_, "trigger");
    return result;
}

} // namespace obscura::instrument
