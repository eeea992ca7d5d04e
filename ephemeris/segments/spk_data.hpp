// SPDX-License-Identifier: Apache-2.0
// Data of an SPK segment by type: a function of time.
#pragma once

#include "ephemeris/segments/segment_data.hpp"
#include "ephemeris/segments/two_body.hpp"
#include "ephemeris/time/epoch.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace obscura::ephemeris {

/// States that one segment holds (NAIF, SPK Required Reading). Immutable, thread-safe.
class SpkData {
public:
    virtual ~SpkData() = default;
    /// Sets `state` at a time within reach(). False: the data are damaged. Real-time safe.
    [[nodiscard]] virtual bool evaluate(TdbTime time, StateKm& state) const noexcept = 0;
    /// Times that the data reach, TDB s since J2000; infinite where they have no end.
    [[nodiscard]] virtual Interval reach() const noexcept = 0;
};

/// The data of a segment of `type`; `words` must outlive them. Throws InputError naming `place` for types
/// that are not supported, for sizes that contradict each other and for times that do not increase.
[[nodiscard]] std::shared_ptr<const SpkData> make_spk_data(const std::string& place, std::int32_t type,
                                                           std::span<const double> words);

/// Makers of each family, as make_spk_data(): Chebyshev series (types 2, 3, 14, 20), difference lines (1,
/// 21), samples (8, 9, 12, 13, 18, 19), orbits (5, 15, 17) and two-line elements (10).
[[nodiscard]] std::shared_ptr<const SpkData> make_spk_series(const std::string& place, std::int32_t type,
                                                             std::span<const double> words);
[[nodiscard]] std::shared_ptr<const SpkData> make_spk_differences(const std::string& place, std::int32_t type,
                                                                  std::span<const double> words);
[[nodiscard]] std::shared_ptr<const SpkData> make_spk_samples(const std::string& place, std::int32_t type,
                                                              std::span<const double> words);
[[nodiscard]] std::shared_ptr<const SpkData> make_spk_orbit(const std::string& place, std::int32_t type,
                                                            std::span<const double> words);
[[nodiscard]] std::shared_ptr<const SpkData> make_spk_two_line(const std::string& place,
                                                               std::span<const double> words);

} // namespace obscura::ephemeris
