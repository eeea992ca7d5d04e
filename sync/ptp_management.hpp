// SPDX-License-Identifier: Apache-2.0
// PTP management messages (IEEE 1588): GET requests to ptp4l and its responses.
#pragma once

#include "core/ptp_status.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace obscura::sync {

/// Requested data sets; IEEE 1588-2008, table 40.
enum class PtpDataSet : std::uint16_t {
    default_set = 0x2000,
    current = 0x2001,
    parent = 0x2002,
    time_properties = 0x2003,
    port = 0x2004,
};
inline constexpr std::array ptp_data_sets{PtpDataSet::default_set, PtpDataSet::current, PtpDataSet::parent,
                                          PtpDataSet::time_properties, PtpDataSet::port};

constexpr std::size_t ptp_get_bytes = 54;

/// Builds a GET for one data set of every port of the clock, IEEE 1588-2008 15.4.
[[nodiscard]] std::array<std::uint8_t, ptp_get_bytes> ptp_get(PtpDataSet set, std::uint8_t domain,
                                                              std::uint16_t sequence);

/// Parses a response to ptp_get(..., sequence) into `status`. Returns false and changes nothing for any other
/// message: another domain, sequence or data set, an error, a wrong length, not PTP. Of several ports the one
/// whose state is closest to slave is used (`state` is unknown at the start of a round).
bool ptp_take_answer(std::span<const std::uint8_t> message, PtpDataSet set, std::uint8_t domain,
                     std::uint16_t sequence, PtpStatus& status);

} // namespace obscura::sync
