// SPDX-License-Identifier: Apache-2.0
#include "transports/registry.hpp"

#include "config/document.hpp"
#include "core/text/printable.hpp"
#include "transports/file/settings.hpp"
#include "transports/gige/settings.hpp"
#include "transports/stimulator/settings.hpp"
#include "transports/v4l2/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace obscura::transports {
namespace {

struct Kind {
    std::unique_ptr<TransportSettings> (*defaults)();
    int start = 0; ///< transports are made and started in the order of this number
};

template<typename Settings>
std::unique_ptr<TransportSettings> defaults() {
    return std::make_unique<TransportSettingsOf<Settings>>();
}

/// One line for each kind of transport, in the order in which their sections are printed.
constexpr std::array kinds{
    Kind{.defaults = defaults<gige::GigeSettings>, .start = 2},
    Kind{.defaults = defaults<FileSinkSettings>, .start = 1},
    Kind{.defaults = defaults<V4l2Settings>, .start = 3},
    Kind{.defaults = defaults<StimulatorSettings>, .start = 4},
};

} // namespace

ConfiguredTransports::ConfiguredTransports() {
    for (const Kind& kind : kinds)
        settings_.push_back(kind.defaults());
}

ConfiguredTransports::ConfiguredTransports(const ConfiguredTransports& other) {
    for (const auto& one : other.settings_)
        settings_.push_back(one->clone());
}

ConfiguredTransports& ConfiguredTransports::operator=(const ConfiguredTransports& other) {
    return *this = ConfiguredTransports(other);
}

std::vector<TransportSettings*> ConfiguredTransports::all() {
    std::vector<TransportSettings*> all;
    for (const auto& one : settings_)
        all.push_back(one.get());
    return all;
}

std::vector<const TransportSettings*> ConfiguredTransports::all() const {
    std::vector<const TransportSettings*> all;
    for (const auto& one : settings_)
        all.push_back(one.get());
    return all;
}

std::vector<config::Section> ConfiguredTransports::sections() {
    std::vector<config::Section> sections;
    for (const auto& one : settings_)
        sections.push_back(one->section());
    return sections;
}

void ConfiguredTransports::check_with(const CameraFacts& camera, const config::Value& root,
                                      const config::Where& where, config::Mistakes& mistakes) const {
    for (const auto& one : settings_)
        one->check_with(camera, config::table_for_checks(root, where, one->kind(), mistakes));
}

void ConfiguredTransports::check_apart(const ConfiguredTransports& earlier, std::string_view earlier_name,
                                       const config::Value& root, const config::Where& where,
                                       config::Mistakes& mistakes) const {
    for (std::size_t i = 0; i < settings_.size(); ++i) {
        if (!settings_[i]->enabled() || !earlier.settings_[i]->enabled()) continue;
        const std::vector<Identity> taken = earlier.settings_[i]->identities();
        const config::ReadTable table = config::table_for_checks(root, where, settings_[i]->kind(), mistakes);
        for (const Identity& mine : settings_[i]->identities())
            if (std::any_of(taken.begin(), taken.end(), [&](const Identity& other) {
                    return other.key == mine.key && other.value == mine.value;
                }))
                table.refuse(mine.key, fmt::format("\"{}\" is the {} of {}, too; each camera needs its own",
                                                   printable(mine.shown), mine.what, earlier_name));
    }
}

std::size_t ConfiguredTransports::frames_held() const {
    std::size_t frames = 0;
    for (const auto& one : settings_)
        if (one->enabled()) frames += one->frames_held();
    return frames;
}

KeptTruth ConfiguredTransports::kept_truth() const {
    KeptTruth truth;
    for (const auto& one : settings_) {
        if (!one->enabled()) continue;
        const KeptTruth wanted = one->wanted_truth();
        truth.pixels = truth.pixels || wanted.pixels;
        truth.scene_entries = std::max(truth.scene_entries, wanted.scene_entries);
    }
    return truth;
}

bool ConfiguredTransports::controls_acquisition() const {
    return std::any_of(settings_.begin(), settings_.end(),
                       [](const auto& one) { return one->enabled() && one->controls_acquisition(); });
}

std::vector<std::unique_ptr<Transport>> ConfiguredTransports::make(const TransportContext& context) const {
    std::vector<std::pair<int, const TransportSettings*>> order;
    for (std::size_t i = 0; i < kinds.size(); ++i)
        if (settings_[i]->enabled()) order.emplace_back(kinds[i].start, settings_[i].get());
    std::sort(order.begin(), order.end());
    std::vector<std::unique_ptr<Transport>> made;
    for (const auto& [start, settings] : order)
        made.push_back(settings->make(context));
    return made;
}

} // namespace obscura::transports
