// SPDX-License-Identifier: Apache-2.0
// Timing policies of the camera: row release, late rows.
#pragma once

#include "core/text/enum_names.hpp"

#include <cstdint>

namespace obscura::emulator {

/// What happens to a frame with a row that is not ready at its release time plus the grace time.
enum class LatePolicy : std::uint8_t {
    late,    ///< the row is released when it is ready
    repeat,  ///< the rest of the frame is copied from the last complete frame
    drop,    ///< the frame is abandoned; if rows of it have been released, it ends after them
    partial, ///< the rows that are ready are released, the rest stays empty
};
constexpr auto enum_names(LatePolicy /*type*/) {
    return std::array{EnumName{LatePolicy::late, "late"}, EnumName{LatePolicy::repeat, "repeat"},
                      EnumName{LatePolicy::drop, "drop"}, EnumName{LatePolicy::partial, "partial"}};
}

/// What gives way when rendering takes longer than there is time.
enum class QualityPolicy : std::uint8_t {
    hold,  ///< the time: rows are rendered as asked, and may be late (LatePolicy)
    adapt, ///< the quality: rows are rendered at levels that keep them in time
};
constexpr auto enum_names(QualityPolicy /*type*/) {
    return std::array{EnumName{QualityPolicy::hold, "hold"}, EnumName{QualityPolicy::adapt, "adapt"}};
}

/// When rows are released: at the chip's readout times, or as soon as they are ready. With `fast` no row is
/// late, and LatePolicy does not apply.
enum class ReadoutTiming : std::uint8_t { sensor, fast };
constexpr auto enum_names(ReadoutTiming /*type*/) {
    return std::array{EnumName{ReadoutTiming::sensor, "sensor"}, EnumName{ReadoutTiming::fast, "fast"}};
}

} // namespace obscura::emulator
