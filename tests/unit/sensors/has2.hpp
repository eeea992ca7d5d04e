// SPDX-License-Identifier: Apache-2.0
// Readout settings of the HAS2 for tests of readouts.
#pragma once

#include "sensors/sensor.hpp"

namespace obscura::test {

/// The HAS2 at 5 MHz: 8 us of row overhead and 200 ns a pixel.
inline ReadoutSettings has2() {
    ReadoutSettings s;
    s.pixel_clock_hz = 5e6;
    s.row_overhead_ns = 8000;
    s.sample_instant_ns = 2000;
    s.reset_instant_ns = 4000;
    return s;
}

} // namespace obscura::test
