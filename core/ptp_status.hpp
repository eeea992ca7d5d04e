// SPDX-License-Identifier: Apache-2.0
// PTP status of this machine's clock as reported by its PTP daemon; polled by sync, published by transports.
#pragma once

#include <cstdint>

namespace obscura {

/// IEEE 1588-2008, table 8: state of a PTP port.
enum class PtpState : std::uint8_t {
    unknown = 0, ///< no answer
    initializing,
    faulty,
    disabled,
    listening,
    pre_master,
    master,
    passive,
    uncalibrated,
    slave,
};

/// A snapshot of the PTP data sets. Identities are EUI-64; 0: unknown.
struct PtpStatus {
    PtpState state = PtpState::unknown;
    bool locked = false;            ///< the clock is the network's grandmaster or follows it
    std::int64_t offset_ns = 0;     ///< from the master
    std::int64_t path_delay_ns = 0; ///< mean
    std::uint64_t clock_id = 0, parent_id = 0, grandmaster_id = 0;
    std::uint8_t clock_accuracy = 0xFE; ///< of the clock itself, IEEE 1588 table 6; 0xFE: unknown
    std::int32_t utc_offset_s = 0;      ///< TAI - UTC as announced
    bool ptp_timescale = false;         ///< the network's time is TAI
    std::uint32_t answers = 0;          ///< polls that were answered since the start

    bool operator==(const PtpStatus&) const = default;
};

} // namespace obscura
