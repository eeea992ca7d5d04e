// SPDX-License-Identifier: Apache-2.0
// Data of a CK segment by type: attitude over the ticks of a spacecraft's clock.
#pragma once

#include "core/geometry.hpp"
#include "ephemeris/segments/evaluation.hpp"
#include "ephemeris/segments/segment_data.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace obscura::ephemeris {

/// Attitudes that one segment holds (NAIF, CK Required Reading). Immutable, thread-safe.
class CkData {
public:
    virtual ~CkData() = default;
    /// Intervals without a gap, in ticks, in order; instants are of length 0.
    [[nodiscard]] virtual std::vector<Interval> coverage() const = 0;
    /// Quaternion of the file at `ticks`, of any length above 0: it takes vectors of the base frame to the
    /// instrument's. Real-time safe.
    [[nodiscard]] virtual Evaluation attitude(double ticks, Quat& from_base) const noexcept = 0;
};

/// The data of a segment of `type`; `rates`: attitudes have angular rates. Throws InputError naming `place`
/// for types that are not supported and damaged data.
[[nodiscard]] std::shared_ptr<const CkData> make_ck_data(const std::string& place, std::int32_t type,
                                                         bool rates, std::span<const double> words);
/// Types 1 (instants), 2 (constant rates) and 3 (linear between attitudes); types 4 (Chebyshev series), 5 and
/// 6 (polynomials through packets).
[[nodiscard]] std::shared_ptr<const CkData> make_ck_attitudes(const std::string& place, std::int32_t type,
                                                              bool rates, std::span<const double> words);
[[nodiscard]] std::shared_ptr<const CkData> make_ck_polynomials(const std::string& place, std::int32_t type,
                                                                std::span<const double> words);

} // namespace obscura::ephemeris
