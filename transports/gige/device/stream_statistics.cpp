// SPDX-License-Identifier: Apache-2.0
// StreamStatistics: counters of the stream sender.
#include "transports/gige/device/accessors.hpp"

#include <array>

namespace obscura::transports::gige {
namespace {

template<auto member>
std::uint64_t get_statistic(const Feature&, DeviceContext& d, std::uint32_t) {
    return d.statistics ? d.statistics().*member : 0U;
}

constexpr std::array stream_statistics_features{
    Feature{.name = "StreamSubmittedFrameCount",
            .custom = true,
            .access = Access::read_only,
            .address = 0xA210,
            .get = get_statistic<&StreamStatistics::submitted>},
    Feature{.name = "StreamDeliveredFrameCount",
            .access = Access::read_only,
            .address = 0xA214,
            .get = get_statistic<&StreamStatistics::delivered>},
    Feature{.name = "StreamLostFrameCount",
            .access = Access::read_only,
            .address = 0xA218,
            .get = get_statistic<&StreamStatistics::dropped>},
    Feature{.name = "StreamResentPacketCount",
            .custom = true,
            .access = Access::read_only,
            .address = 0xA21C,
            .get = get_statistic<&StreamStatistics::resent>},
    Feature{.name = "StreamAskedPacketCount",
            .custom = true,
            .tooltip = "Packets that receivers asked for: those resent, those not sent yet, those refused",
            .access = Access::read_only,
            .address = 0xA220,
            .get = get_statistic<&StreamStatistics::asked>},
    Feature{.name = "StreamAskedBeforeSentPacketCount",
            .custom = true,
            .tooltip = "Packets that receivers asked for before they were sent: late, not lost",
            .access = Access::read_only,
            .address = 0xA224,
            .get = get_statistic<&StreamStatistics::asked_before_sent>},
    Feature{.name = "StreamRefusedPacketCount",
            .custom = true,
            .tooltip = "Packets that receivers asked for and that cannot be sent again",
            .access = Access::read_only,
            .address = 0xA228,
            .get = get_statistic<&StreamStatistics::refused>},
};

} // namespace

FeatureCategory stream_statistics() {
    return {.name = "StreamStatistics",
            .features = stream_statistics_features,
            .parent = "TransportLayerControl",
            .custom = true};
}

} // namespace obscura::transports::gige
