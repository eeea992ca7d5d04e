// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/feature_table.hpp"

#include "transports/gige/device/device_context.hpp"
#include "transports/gige/device/regions.hpp"

#include <fmt/format.h>

#include <array>
#include <map>
#include <stdexcept>
#include <utility>

namespace obscura::transports::gige {
namespace {

constexpr std::array root_features{
    Feature{.name = "TLParamsLocked",
            .visibility = Visibility::invisible,
            .minimum = fixed(0),
            .maximum = fixed(1)},
};

using Addresses = std::map<std::string, std::pair<std::uint32_t, std::uint32_t>, std::less<>>;

Addresses all_addresses() {
    Addresses all; // address and stride
    for (const FeatureCategory& category : feature_table())
        for (const Feature& f : category.features) {
            if (f.has_register()) all.emplace(f.name, std::pair{f.address, f.stride});
            for (const auto& [bound, suffix] : {std::pair{&f.minimum, minimum_suffix},
                                                {&f.maximum, maximum_suffix},
                                                {&f.increment, increment_suffix}})
                if (bound->address != 0)
                    all.emplace(fmt::format("{}{}", f.name, suffix), std::pair{bound->address, 0U});
        }
    return all;
}

bool locked(const Feature& f, std::uint32_t index) {
    return f.lock == FeatureLock::streaming || f.lock == FeatureLock::streaming_unmarked ||
           (f.lock == FeatureLock::streaming_but_first && index > 0);
}

/// Number of registers of the feature on this device.
std::uint32_t items_of(const Feature& f, const DeviceContext& d) {
    if (f.stride == 0) return 1;
    const std::string_view selector = f.selectors[0];
    return selector == "RegionSelector" ? region_count(d) : item_count(feature(selector));
}

void add_limit(const Feature& f, const FeatureBound& bound, DeviceContext& d) {
    if (bound.address == 0) return;
    d.bank.add({.name = f.name, .address = bound.address, .read = [&f, &bound, &d] {
                    return static_cast<std::uint32_t>(bound.get(f, d, 0));
                }});
}

void add_command(const Feature& f, std::uint32_t address, std::uint32_t index, DeviceContext& d) {
    d.bank.add({.name = f.name,
                .address = address,
                .access = Access::write_only,
                .write = [&f, &d, index](std::uint32_t word) {
                    return word == f.command_value ? f.run(d, index) : Status::invalid_parameter;
                }});
}

void add_word(const Feature& f, std::uint32_t address, std::uint32_t index, DeviceContext& d) {
    Register r{.name = f.name, .address = address, .access = f.access};
    r.locked_while_streaming = locked(f, index);
    r.saved = f.access == Access::read_write && f.in_user_set;
    if (f.reset != nullptr) r.reset = f.reset(d);
    if (f.get != nullptr) r.read = [&f, &d, index] { return static_cast<std::uint32_t>(f.get(f, d, index)); };
    if (f.kept != nullptr)
        r.kept = [&f, &d, index] { return static_cast<std::uint32_t>(f.kept(f, d, index)); };
    if (f.access == Access::read_write)
        r.write = [&f, &d, index, address](std::uint32_t word) {
            if (!in_range(f, word)) return Status::invalid_parameter;
            if (f.set != nullptr) return f.set(f, d, index, word);
            d.bank.poke(address, word);
            return Status::success;
        };
    if (f.written != nullptr) r.written = [&f, &d, index] { f.written(d, index); };
    d.bank.add(std::move(r));
}

/// 64 bits as two words, the more significant one first.
void add_long_word(const Feature& f, DeviceContext& d) {
    d.bank.add({.name = f.name, .address = f.address, .read = [&f, &d] {
                    return static_cast<std::uint32_t>(f.get(f, d, 0) >> 32);
                }});
    d.bank.add({.name = f.name, .address = f.address + 4, .read = [&f, &d] {
                    return static_cast<std::uint32_t>(f.get(f, d, 0));
                }});
}

void add_registers(const Feature& f, DeviceContext& d) {
    add_limit(f, f.minimum, d);
    add_limit(f, f.maximum, d);
    add_limit(f, f.increment, d);
    if (!f.has_register() || f.address < manufacturer_begin) return;
    if (f.access == Access::read_only && f.get == nullptr && f.text == nullptr)
        throw std::logic_error(fmt::format("feature {} has a register and no getter", f.name));
    if (f.type == FeatureType::string) {
        d.bank.add_string(f.name, f.address, f.bytes, Access::read_only, f.text(d));
        return;
    }
    if (f.bytes == 8) {
        add_long_word(f, d);
        return;
    }
    for (std::uint32_t i = 0; i < items_of(f, d); ++i) {
        const std::uint32_t address = f.address + i * f.stride;
        if (f.type == FeatureType::command) {
            add_command(f, address, i, d);
        } else {
            add_word(f, address, i, d);
        }
    }
}

} // namespace

std::span<const FeatureCategory> feature_table() {
    static const std::array table{
        device_control(),
        image_format_control(),
        acquisition_control(),
        analog_control(),
        digital_io_control(),
        counter_and_timer_control(),
        sequencer_control(),
        chunk_data_control(),
        action_control(),
        event_control(),
        user_set_control(),
        test_control(),
        transport_layer_control(),
        gige_vision(),
        ptp_control(),
        stream_statistics(),
        FeatureCategory{.name = "Root", .features = root_features, .parent = {}},
    };
    return table;
}

const Feature& feature(std::string_view name) {
    const Feature* found = find_feature(feature_table(), name);
    if (found == nullptr) throw std::logic_error(fmt::format("no feature {} in the table", name));
    return *found;
}

std::uint32_t address_of(std::string_view name, std::uint32_t index) {
    static const Addresses addresses = all_addresses();
    const auto found = addresses.find(name);
    if (found == addresses.end()) throw std::logic_error(fmt::format("no register of feature {}", name));
    return found->second.first + index * found->second.second;
}

void add_feature_registers(DeviceContext& d) {
    for (const FeatureCategory& category : feature_table())
        for (const Feature& f : category.features)
            add_registers(f, d);
}

} // namespace obscura::transports::gige
