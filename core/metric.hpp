// SPDX-License-Identifier: Apache-2.0
// One number that a daemon counts or measures, with its names in the state, for Prometheus, on the status
// page and in telemetry.
#pragma once

#include "core/member_chain.hpp"
#include "core/text/enum_names.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>
#include <utility>

namespace obscura {

/// TYPE of the text format of Prometheus.
enum class MetricType : std::uint8_t { counter, gauge, histogram };
constexpr auto enum_names(MetricType /*type*/) {
    return std::array{EnumName{MetricType::counter, "counter"}, EnumName{MetricType::gauge, "gauge"},
                      EnumName{MetricType::histogram, "histogram"}};
}

/// The number stands at `group`/`name` in the state of a camera. Its other names are empty where it is not
/// shown.
struct Metric {
    std::string_view group, name;

    // Prometheus. Rows of one family stand together, or one after the other; its help is that of the first.
    std::string_view family = {};
    MetricType type = MetricType::counter;
    std::string_view help = {};
    std::string_view label = {}, label_value = {}; ///< empty: none

    std::string_view status = {}; ///< words after the number on the status page
    int status_place = 0;         ///< on the page, from 0

    std::string_view telemetry = {}, telemetry_help = {}; ///< field of the housekeeping packet
    int telemetry_place = 0;                              ///< among the counters of the packet, from 0

    [[nodiscard]] constexpr Metric as_gauge(std::string_view family_name,
                                            std::string_view family_help) const {
        Metric out = *this;
        out.family = family_name, out.type = MetricType::gauge, out.help = family_help;
        return out;
    }
    [[nodiscard]] constexpr Metric as_histogram(std::string_view family_name,
                                                std::string_view family_help) const {
        Metric out = as_gauge(family_name, family_help);
        out.type = MetricType::histogram;
        return out;
    }
    [[nodiscard]] constexpr Metric as_counter(std::string_view family_name, std::string_view family_help,
                                              std::string_view with_label = {},
                                              std::string_view value_of_label = {}) const {
        Metric out = as_gauge(family_name, family_help);
        out.type = MetricType::counter;
        out.label = with_label, out.label_value = value_of_label;
        return out;
    }
};

/// A metric that is a member of `Counters`.
template<typename Counters>
struct CounterMetric : Metric {
    std::size_t element = 0;
    std::uint64_t (*get)(const Counters& counters, std::size_t element) = nullptr;

    [[nodiscard]] constexpr std::uint64_t value(const Counters& counters) const {
        return get(counters, element);
    }
    /// `family_help` is empty in rows after the first of a family.
    [[nodiscard]] constexpr CounterMetric as_counter(std::string_view family_name,
                                                     std::string_view family_help,
                                                     std::string_view with_label = {},
                                                     std::string_view value_of_label = {}) const {
        CounterMetric out = *this;
        static_cast<Metric&>(out) = Metric::as_counter(family_name, family_help, with_label, value_of_label);
        return out;
    }
    [[nodiscard]] constexpr CounterMetric on_status(int place, std::string_view words) const {
        CounterMetric out = *this;
        out.status_place = place, out.status = words;
        return out;
    }
    [[nodiscard]] constexpr CounterMetric in_telemetry(int place, std::string_view field,
                                                       std::string_view field_help) const {
        CounterMetric out = *this;
        out.telemetry_place = place, out.telemetry = field, out.telemetry_help = field_help;
        return out;
    }
};

/// The row of a member: counter<&CameraCounters::lod, &LodCounters::frames>("camera/lod_deficit", "frames").
template<auto first, auto... rest>
constexpr auto counter(std::string_view group, std::string_view name, std::size_t element = 0) {
    using Counters = decltype(member_chain::owner_of(first));
    CounterMetric<Counters> out;
    out.group = group, out.name = name, out.element = element;
    out.get = [](const Counters& counters, std::size_t at) -> std::uint64_t {
        const auto& member = member_chain::at<first, rest...>(counters);
        if constexpr (std::is_integral_v<std::remove_cvref_t<decltype(member)>>) {
            return member;
        } else {
            return member[at];
        }
    };
    return out;
}

} // namespace obscura
