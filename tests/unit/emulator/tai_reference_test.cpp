// SPDX-License-Identifier: Apache-2.0
// TAI where the kernel has no offset: by PTP or the leap second list, else said to be unknown.
#include "core/clock.hpp"
#include "core/time.hpp"
#include "emulator/daemon/tai_reference.hpp"
#include "tests/support/catch.hpp"

#include <sys/timex.h>

#include <cmath>
#include <ctime>

namespace tai_reference_test {

using namespace obscura;
using namespace obscura::emulator;

// Dates of IERS Bulletin C: 36 s from 2015-07-01, 37 s from 2017-01-01 on.
constexpr std::int64_t end_of_2016_utc_s = 1'483'228'800, in_november_2026_utc_s = 1'795'824'000;

TEST_CASE("without an offset of the kernel TAI is UTC plus the seconds of the list") {
    const ephemeris::LeapSeconds list = ephemeris::erfa_leap_seconds();
    const TaiCorrection in_2026{37 * ns_per_s, TaiSource::list};
    CHECK(tai_correction(0, 0, list, in_november_2026_utc_s) == in_2026);
    CHECK(tai_correction(0, 0, list, end_of_2016_utc_s) == in_2026);
    CHECK(tai_correction(0, 0, list, end_of_2016_utc_s - 1) == TaiCorrection{36 * ns_per_s, TaiSource::list});
    CHECK(tai_correction(0, 0, list, 63'072'000) == TaiCorrection{10 * ns_per_s, TaiSource::list}); // 1972
}

TEST_CASE("the kernel's offset comes before that of PTP, and both before the list") {
    const ephemeris::LeapSeconds list = ephemeris::erfa_leap_seconds();
    CHECK(tai_correction(37, 0, list, in_november_2026_utc_s) == TaiCorrection{0, TaiSource::kernel});
    CHECK(tai_correction(37, 5, list, in_november_2026_utc_s) == TaiCorrection{0, TaiSource::kernel});
    CHECK(tai_correction(0, 38 * ns_per_s, list, in_november_2026_utc_s) ==
          TaiCorrection{38 * ns_per_s, TaiSource::ptp});
}

TEST_CASE("without a list for the machine's time TAI is not known") {
    CHECK(tai_correction(0, 0, {}, in_november_2026_utc_s) == TaiCorrection{0, TaiSource::unknown});
    // A clock that was never set.
    for (const std::int64_t utc_s : {-1, 0, 63'071'999})
        CHECK(tai_correction(0, 0, ephemeris::erfa_leap_seconds(), utc_s) == TaiCorrection{});
}

TEST_CASE("the scheduling clock of this machine maps to TAI, whatever its kernel knows") {
    timex kernel{};
    REQUIRE(::adjtimex(&kernel) >= 0);
    CHECK(kernel_tai_minus_utc_s() == kernel.tai);
    TaiReference reference;
    MonotonicClock clock;
    CHECK(clock.tai_source() == TaiSource::unknown);
    clock.set_tai_correction(reference.refresh(0));
    CHECK(clock.tai_source() == (kernel.tai != 0 ? TaiSource::kernel : TaiSource::list));
    timespec utc{};
    ::clock_gettime(CLOCK_REALTIME, &utc);
    const double ahead_s = to_seconds(clock.now().ns + clock.tai_offset_ns()) -
                           static_cast<double>(utc.tv_sec) - 1e-9 * static_cast<double>(utc.tv_nsec);
    CHECK(std::abs(ahead_s - (kernel.tai != 0 ? kernel.tai : 37)) < 0.5); // 37 s since 2017
}

} // namespace tai_reference_test
