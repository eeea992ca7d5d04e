// SPDX-License-Identifier: Apache-2.0
// TAI of this machine: by its kernel, the network's PTP clock or the leap second list.
#pragma once

#include "core/tai_source.hpp"
#include "ephemeris/time/leap_seconds.hpp"

#include <cstdint>
#include <string>

namespace obscura::emulator {

/// What makes TAI of CLOCK_TAI. `kernel_tai_s`: the kernel's TAI - UTC, 0 where it has none, which is the
/// first to count; then `ptp_ns`, see sync::PtpMonitor::tai_correction_ns(), unless 0; then the value of
/// `list` at `utc_s` (s since 1970), a time from its first step on.
[[nodiscard]] TaiCorrection tai_correction(int kernel_tai_s, std::int64_t ptp_ns,
                                           const ephemeris::LeapSeconds& list, std::int64_t utc_s);

/// What it comes from, as a phrase for people; `list` as above.
[[nodiscard]] std::string tai_text(const TaiCorrection& correction, const ephemeris::LeapSeconds& list);

/// CLOCK_TAI minus CLOCK_REALTIME in s, as adjtimex() tells it, too; 0: the kernel does not know it.
/// Thread-safe.
[[nodiscard]] int kernel_tai_minus_utc_s() noexcept;

/// Follows the machine's correction, with a line in the log for each change of its source, and reads the
/// system's leap second list at first and then daily. Thread-bound: main thread.
class TaiReference {
public:
    /// The correction at present; `ptp_ns` as for tai_correction().
    [[nodiscard]] TaiCorrection refresh(std::int64_t ptp_ns);

private:
    ephemeris::LeapSeconds list_;
    std::int64_t list_day_ = INT64_MIN; ///< UTC day on which it was read, since 1970
    bool logged_ = false;
    TaiSource source_ = TaiSource::unknown; ///< in the log
};

} // namespace obscura::emulator
