// SPDX-License-Identifier: Apache-2.0
// PtpControl: state of the PTP clock of this machine, live or as it was at the last latch.
#include "transports/gige/device/accessors.hpp"

#include <array>

namespace obscura::transports::gige {
namespace {

PtpStatus ptp_now(const DeviceContext& d) {
    return d.ptp ? d.ptp() : PtpStatus{};
}

/// Member of the status at the last latch, so that all features read after it belong together.
template<auto member>
std::uint64_t get_latched(const Feature&, DeviceContext& d, std::uint32_t) {
    return static_cast<std::uint64_t>(d.ptp_latched.*member);
}

constexpr std::array ptp_states{
    FeatureEntry{.name = "Disconnected", .value = value(PtpState::unknown), .custom = true},
    entry("Initializing", PtpState::initializing),
    entry("Faulty", PtpState::faulty),
    entry("Disabled", PtpState::disabled),
    entry("Listening", PtpState::listening),
    entry("PreMaster", PtpState::pre_master),
    entry("Master", PtpState::master),
    entry("Passive", PtpState::passive),
    entry("Uncalibrated", PtpState::uncalibrated),
    entry("Slave", PtpState::slave),
};

constexpr std::array ptp_servo_status_entries{
    entry("Unknown", 0),
    entry("Locked", 1),
};

constexpr std::array ptp_features{
    Feature{.name = "PtpEnable",
            .type = FeatureType::boolean,
            .visibility = Visibility::expert,
            .tooltip = "Whether the camera asks a PTP daemon; the configuration of the machine decides",
            .access = Access::read_only,
            .address = 0xA900,
            .get = [](const Feature&, DeviceContext& d, std::uint32_t) -> std::uint64_t {
                return d.ptp ? 1 : 0;
            }},
    Feature{.name = "PtpStatus",
            .type = FeatureType::enumeration,
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .address = 0xA904,
            .entries = ptp_states,
            .get = [](const Feature&, DeviceContext& d, std::uint32_t) -> std::uint64_t {
                return value(ptp_now(d).state);
            }},
    Feature{.name = "PtpServoStatus",
            .type = FeatureType::enumeration,
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .address = 0xA908,
            .entries = ptp_servo_status_entries,
            .get = [](const Feature&, DeviceContext& d, std::uint32_t) -> std::uint64_t {
                return ptp_now(d).locked ? 1 : 0;
            }},
    Feature{.name = "PtpDataSetLatch",
            .type = FeatureType::command,
            .visibility = Visibility::expert,
            .tooltip = "Takes the values of the features below",
            .address = 0xA90C,
            .run =
                [](DeviceContext& d, std::uint32_t) {
                    d.ptp_latched = ptp_now(d);
                    return Status::success;
                }},
    Feature{.name = "PtpClockAccuracy",
            .custom = true,
            .visibility = Visibility::expert,
            .tooltip = "IEEE 1588 table 6; 254: unknown",
            .access = Access::read_only,
            .address = 0xA910,
            .get = get_latched<&PtpStatus::clock_accuracy>},
    Feature{.name = "PtpOffsetFromMaster",
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .address = 0xA918,
            .bytes = 8,
            .unit = "ns",
            .is_signed = true,
            .get = get_latched<&PtpStatus::offset_ns>},
    Feature{.name = "PtpMeanPropagationDelay",
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .address = 0xA920,
            .bytes = 8,
            .unit = "ns",
            .is_signed = true,
            .get = get_latched<&PtpStatus::path_delay_ns>},
    Feature{.name = "PtpClockID",
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .address = 0xA928,
            .bytes = 8,
            .get = get_latched<&PtpStatus::clock_id>},
    Feature{.name = "PtpParentClockID",
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .address = 0xA930,
            .bytes = 8,
            .get = get_latched<&PtpStatus::parent_id>},
    Feature{.name = "PtpGrandmasterClockID",
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .address = 0xA938,
            .bytes = 8,
            .get = get_latched<&PtpStatus::grandmaster_id>},
    Feature{.name = "PtpUtcOffset",
            .custom = true,
            .visibility = Visibility::expert,
            .tooltip = "TAI - UTC as announced",
            .access = Access::read_only,
            .address = 0xA914,
            .unit = "s",
            .is_signed = true,
            .get = get_latched<&PtpStatus::utc_offset_s>},
    Feature{.name = "GevIEEE1588",
            .type = FeatureType::boolean,
            .visibility = Visibility::expert,
            .tooltip = "Whether the camera asks a PTP daemon; the configuration of the machine decides",
            .access = Access::read_only,
            .value_of = "PtpEnable"},
    Feature{.name = "GevIEEE1588Status",
            .type = FeatureType::enumeration,
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .value_of = "PtpStatus",
            .entries = ptp_states},
};

} // namespace

FeatureCategory ptp_control() {
    return {.name = "PtpControl", .features = ptp_features, .parent = "TransportLayerControl"};
}

} // namespace obscura::transports::gige
