// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/spk_segment.hpp"

#include "core/error.hpp"
#include "core/pose_range.hpp"
#include "ephemeris/segments/segment_data.hpp"

#include <fmt/format.h>

namespace obscura::ephemeris {

std::shared_ptr<const SpkData> make_spk_data(const std::string& place, std::int32_t type,
                                             std::span<const double> words) {
    switch (type) {
    case 1:
    case 21:
        return make_spk_differences(place, type, words);
    case 2:
    case 3:
    case 14:
    case 20:
        return make_spk_series(place, type, words);
    case 5:
    case 15:
    case 17:
        return make_spk_orbit(place, type, words);
    case 8:
    case 9:
    case 12:
    case 13:
    case 18:
    case 19:
        return make_spk_samples(place, type, words);
    case 10:
        return make_spk_two_line(place, words);
    default:
        throw InputError(fmt::format(
            "{}: SPK type {} is not supported, allowed 1, 2, 3, 5, 8, 9, 10, 12, 13, 14, 15, 17, 18, 19, 20, 21",
            place, type));
    }
}

SpkSegment::SpkSegment(const Daf::Array& array)
    : place_(array.place),
      target_(array.integers.at(0)),
      center_(array.integers.at(1)),
      frame_(array.integers.at(2)),
      type_(array.integers.at(3)),
      begin_s_(array.doubles.at(0)),
      end_s_(array.doubles.at(1)) {
    if (target_ == center_) throw InputError(fmt::format("{}: body {} relative to itself", place_, target_));
    data_ = make_spk_data(place_, type_, array.words);
    const Interval reach = data_->reach();
    limit_coverage(place_, begin_s_, end_s_, reach.begin_s, reach.end_s);
}

bool SpkSegment::evaluate(TdbTime time, State& state) const noexcept {
    constexpr double m_per_km = 1000;
    StateKm km;
    if (!data_->evaluate(time, km)) return false;
    state = {km.position * m_per_km, km.velocity * m_per_km};
    return is_in_range(state.position_m) && is_finite(state.velocity_m_s);
}

} // namespace obscura::ephemeris
