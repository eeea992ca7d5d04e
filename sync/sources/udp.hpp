// SPDX-License-Identifier: Apache-2.0
// Trigger source "udp": trigger datagrams.
#pragma once

#include "sync/inputs/udp_input.hpp"
#include "sync/source_kind.hpp"

#include <string>

namespace obscura::sync {

/// Makes an EdgeTrigger on a UDP socket.
class UdpKind final : public SourceKindOf<UdpKind> {
public:
    static constexpr SourceTraits description{.name = "udp", .help = "trigger datagrams"};

    std::string listen = "127.0.0.1:5002"; ///< IPv4 address and port
    bool accept_empty = false;             ///< an empty datagram is a trigger
    double max_rate_hz = UdpTriggers{}.max_rate_hz;

    [[nodiscard]] config::Keys keys() override;
    void check(const TriggerLineSettings& line, const Refuse& refuse) const override;
    [[nodiscard]] std::unique_ptr<TriggerSource> make(const TriggerLineSettings& line, const Clock& clock,
                                                      const ThreadSettings& thread) const override;

    bool operator==(const UdpKind&) const = default;
};

} // namespace obscura::sync
