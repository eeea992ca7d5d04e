// SPDX-License-Identifier: Apache-2.0
// SCLK kernel of the spacecraft -77 with its frame CRAFT, whose attitudes a CK has.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>

namespace obscura::test {

/// `coefficients`: records of ticks, s since J2000 and s per second of the clock, which has 100 ticks.
inline std::string clock_kernel(std::string_view coefficients) {
    return fmt::format(R"(KPL/SCLK
\begindata
SCLK_DATA_TYPE_77       = ( 1 )
SCLK01_TIME_SYSTEM_77   = ( 1 )
SCLK01_N_FIELDS_77      = ( 2 )
SCLK01_MODULI_77        = ( 1000000 100 )
SCLK01_OFFSETS_77       = ( 0 0 )
SCLK01_COEFFICIENTS_77  = ( {} )
FRAME_CRAFT             = -77001
FRAME_-77001_NAME       = 'CRAFT'
FRAME_-77001_CLASS      = 3
FRAME_-77001_CLASS_ID   = -77001
FRAME_-77001_CENTER     = -77
CK_-77001_SCLK          = -77
\begintext
)",
                       coefficients);
}

} // namespace obscura::test
