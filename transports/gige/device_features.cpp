// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device_features.hpp"

#include "transports/gige/channels/network_interface.hpp"
#include "transports/gige/device/feature_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace obscura::transports::gige {
namespace {

constexpr std::array<std::string_view, 7> feature_type_names{"integer", "float",  "enumeration", "boolean",
                                                             "command", "string", "integer"};
constexpr std::array<std::string_view, 4> visibility_names{"Beginner", "Expert", "Guru", "Invisible"};
/// Features of the client's stream: camera.start and camera.stop acquire without one.
constexpr std::array<std::string_view, 3> of_the_client{"AcquisitionStart", "AcquisitionStop",
                                                        "AcquisitionAbort"};

constexpr bool is_address(const Feature& f) {
    return f.representation == "IPV4Address";
}

/// Whether its value is a choice that a client makes for itself: the items stand beside each other here.
constexpr bool is_selector(const Feature& f) {
    return !f.has_register() && f.value_of.empty() && f.access == Access::read_write &&
           f.type != FeatureType::command;
}

/// A field of a word, whose bits GigE Vision counts from the most significant one.
std::uint32_t bits_of(const Feature& f, std::uint32_t word) {
    if (!f.bits.given()) return word;
    const int width = f.bits.lsb - f.bits.msb + 1;
    return static_cast<std::uint32_t>(word >> (31 - f.bits.lsb) & ((std::uint64_t{1} << width) - 1));
}

double number_of(const Feature& f, std::uint32_t word) {
    return (f.is_signed ? static_cast<double>(static_cast<std::int32_t>(word)) : word) / f.scale;
}

DeviceFeatures::Value decoded(const Feature& f, std::uint32_t word) {
    switch (f.type) {
    case FeatureType::floating:
        return number_of(f, word);
    case FeatureType::boolean:
        return word != 0;
    case FeatureType::enumeration: {
        const auto entry = std::find_if(f.entries.begin(), f.entries.end(),
                                        [word](const FeatureEntry& e) { return e.value == word; });
        return entry != f.entries.end() ? std::string(entry->name) : fmt::format("{}", word);
    }
    default:
        if (is_address(f)) return dotted(word);
        return f.is_signed ? std::int64_t{static_cast<std::int32_t>(word)} : std::int64_t{word};
    }
}

/// The word for a value; none: it is of another type, or beyond what a register holds.
std::optional<std::uint32_t> encoded(const Feature& f, const DeviceFeatures::Value& value) {
    if (f.type == FeatureType::boolean) {
        const bool* const on = std::get_if<bool>(&value);
        return on != nullptr ? std::optional<std::uint32_t>(*on ? 1 : 0) : std::nullopt;
    }
    if (f.type == FeatureType::enumeration) {
        const auto* const name = std::get_if<std::string>(&value);
        const auto entry = std::find_if(f.entries.begin(), f.entries.end(), [name](const FeatureEntry& e) {
            return name != nullptr && e.name == *name;
        });
        return entry != f.entries.end() ? std::optional(entry->value) : std::nullopt;
    }
    const auto* const whole = std::get_if<std::int64_t>(&value);
    const auto* const real = std::get_if<double>(&value);
    if (whole == nullptr && (real == nullptr || f.type != FeatureType::floating)) return std::nullopt;
    const double words = std::round((whole != nullptr ? static_cast<double>(*whole) : *real) * f.scale);
    const double least = f.is_signed ? std::numeric_limits<std::int32_t>::min() : 0;
    const double most = f.is_signed ? std::numeric_limits<std::int32_t>::max() : UINT32_MAX;
    if (!(words >= least && words <= most)) return std::nullopt;
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(words));
}

std::string reason_of(Status status) {
    switch (status) {
    case Status::success:
        return {};
    case Status::invalid_parameter:
        return "this value is not allowed";
    case Status::write_protect:
    case Status::access_denied:
        return "cannot be written now";
    case Status::busy:
        return "the camera is busy";
    default:
        return fmt::format("refused with status 0x{:04X}", static_cast<unsigned>(status));
    }
}

} // namespace

std::vector<GigeFeatures::Item> GigeFeatures::items_of(const Feature& f) const {
    if (f.stride == 0) return {{&f, f.address, std::string(f.name)}};
    const Feature& selector = feature(f.selectors[0]);
    std::vector<Item> items;
    for (std::uint32_t i = 0; i < item_count(selector); ++i) {
        const std::uint32_t address = f.address + i * f.stride;
        const Register* const found = device_.registers().find(address);
        if (found == nullptr || found->name != f.name) continue;
        const auto entry = std::find_if(selector.entries.begin(), selector.entries.end(),
                                        [i](const FeatureEntry& e) { return e.value == i; });
        if (!selector.entries.empty() && entry == selector.entries.end()) continue;
        const std::string item =
            entry != selector.entries.end() ? std::string(entry->name) : fmt::format("{}", i);
        items.push_back({&f, address, fmt::format("{}[{}]", f.name, item)});
    }
    return items;
}

std::optional<DeviceFeatures::Value> GigeFeatures::value_of(const Item& item) const {
    const Feature& f = *item.feature;
    if (f.type == FeatureType::command) return Value{};
    if (!f.value_of.empty()) {
        const Feature& shown = feature(f.value_of);
        if (!shown.has_register()) return std::nullopt; // a formula
        std::uint32_t word = 0;
        if (device_.registers().read_word(shown.address, word) != Status::success) return std::nullopt;
        return decoded(f, bits_of(shown, word));
    }
    if (!f.has_register()) return decoded(f, f.constant);
    if (f.type == FeatureType::string) return device_.registers().text(item.address);
    std::uint32_t word = 0;
    if (device_.registers().read_word(item.address, word) != Status::success) return std::nullopt;
    if (f.bytes != 8) return decoded(f, bits_of(f, word));
    std::uint32_t low = 0;
    if (device_.registers().read_word(item.address + 4, low) != Status::success) return std::nullopt;
    return static_cast<std::int64_t>(std::uint64_t{word} << 32 | low);
}

std::optional<double> GigeFeatures::bound_of(const Feature& f, const FeatureBound& bound) const {
    if (bound.fixed) return bound.fixed;
    std::uint32_t word = 0;
    if (bound.address != 0)
        return device_.registers().read_word(bound.address, word) == Status::success
                   ? std::optional(number_of(f, word))
                   : std::nullopt;
    const Feature* const holder = find_feature(feature_table(), bound.held_by);
    if (holder == nullptr || !holder->has_register() || holder->bytes != 4 ||
        device_.registers().read_word(holder->address, word) != Status::success)
        return std::nullopt;
    return number_of(*holder, bits_of(*holder, word));
}

bool GigeFeatures::writable(const Item& item) const {
    const Feature& f = *item.feature;
    if (std::find(of_the_client.begin(), of_the_client.end(), f.name) != of_the_client.end()) return false;
    if (f.name == "DeviceUserID") return true;
    if (!f.has_register() || item.address < manufacturer_begin || f.bits.given() || f.bytes == 8)
        return false;
    return f.type == FeatureType::command ||
           (f.access == Access::read_write && f.type != FeatureType::string && !is_address(f));
}

bool GigeFeatures::is_idle(const Item& item) const {
    const Feature& f = *item.feature;
    if (f.stride == 0 || f.selectors[0] != "RegionSelector" || f.name == "RegionMode") return false;
    std::uint32_t on = 1;
    const std::uint32_t region = (item.address - f.address) / f.stride;
    return device_.registers().read_word(address_of("RegionMode", region), on) == Status::success && on == 0;
}

std::vector<DeviceFeatures::Row> GigeFeatures::list() {
    std::vector<Row> rows;
    const bool acquiring = control_.acquiring();
    for (const FeatureCategory& category : feature_table())
        for (const Feature& f : category.features) {
            if (!f.listed || f.visibility == Visibility::invisible || f.chunk ||
                f.type == FeatureType::formula || is_selector(f))
                continue;
            for (Item& item : items_of(f)) {
                std::optional<Value> value = is_idle(item) ? std::nullopt : value_of(item);
                if (!value) continue;
                Row row;
                row.writable = writable(item);
                const Register* const held =
                    f.has_register() ? device_.registers().find(item.address) : nullptr;
                row.locked = acquiring && held != nullptr && held->locked_while_streaming;
                row.name = std::move(item.name);
                row.category = category.name;
                row.type = feature_type_names[static_cast<std::size_t>(f.type)];
                row.unit = f.unit;
                row.help = f.tooltip;
                row.visibility = visibility_names[static_cast<std::size_t>(f.visibility)];
                row.value = *std::move(value);
                row.minimum = bound_of(f, f.minimum);
                row.maximum = bound_of(f, f.maximum);
                row.increment = bound_of(f, f.increment);
                for (const FeatureEntry& entry : f.entries)
                    row.entries.push_back(entry.name);
                rows.push_back(std::move(row));
            }
        }
    return rows;
}

std::string GigeFeatures::set(std::string_view name, const Value& value) {
    const Feature* const f = find_feature(feature_table(), name.substr(0, name.find('[')));
    std::vector<Item> items = f != nullptr && f->listed && !f->chunk ? items_of(*f) : std::vector<Item>{};
    const auto item =
        std::find_if(items.begin(), items.end(), [name](const Item& one) { return one.name == name; });
    if (item == items.end()) return "no such feature";
    if (!writable(*item)) return "cannot be written here";
    RegisterBank& bank = device_.registers();
    Status status = Status::success;
    if (f->type == FeatureType::string) {
        const auto* const text = std::get_if<std::string>(&value);
        if (text == nullptr || text->size() > f->bytes || !is_register_text(*text))
            return fmt::format("allowed are up to {} printable ASCII characters", f->bytes);
        std::vector<std::uint8_t> bytes(text->begin(), text->end());
        bytes.resize(f->bytes);
        std::size_t done = 0;
        status = bank.write(item->address, bytes, done);
    } else if (f->type == FeatureType::command) {
        const bool* const now = std::get_if<bool>(&value);
        if (now == nullptr || !*now) return "a command: true runs it";
        status = bank.write_word(item->address, f->command_value);
    } else {
        const std::optional<std::uint32_t> word = encoded(*f, value);
        if (!word) return "this value is not allowed";
        status = bank.write_word(item->address, *word);
    }
    device_.keep_state();
    return reason_of(status);
}

} // namespace obscura::transports::gige
