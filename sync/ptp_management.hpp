// PTP management messages (IEEE 1588): GET requests to ptp4l and its responses.
#pragma once

#include "core/ptp_status.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace obscura::sync {

/// The data sets that are asked for; IEEE 1588-2008, table 40.
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

/// A GET for one data set of every port of the clock, IEEE 1588-2008 15.4.
[[nodiscard]] std::array<std::uint8_t, ptp_get_bytes> ptp_get(PtpDataSet set, std::uint8_t domain,
                                                              std::uint16_t sequence);

/// Takes an answer to ptp_get(..., sequence) into `status`. False, and nothing changed, for anything else:
/// another domain, sequence or data set, an error, wrong lengths, no PTP at all. Of several ports the one
/// that is furthest in following a master counts (`state` starts a round as unknown).
bool ptp_take_answer(std::span<const std::uint8_t> message, PtpDataSet set, std::uint8_t domain,
                     std::uint16_t sequence, PtpStatus& status);

} // namespace obscura::sync
