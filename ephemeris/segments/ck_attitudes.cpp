// SPDX-License-Identifier: Apache-2.0
// CK types 1, 2 and 3: attitudes at instants, at constant rates, and between attitudes.
#include "core/error.hpp"
#include "ephemeris/segments/ck_data.hpp"
#include "ephemeris/segments/segment_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::ephemeris {
namespace {

Quat quaternion_at(std::span<const double> words, std::size_t at) noexcept {
    return {words[at], words[at + 1], words[at + 2], words[at + 3]};
}

/// Throws unless all quaternions, one at the start of each `stride` words, have length 1.
void require_quaternions(const std::string& place, std::span<const double> words, std::size_t stride) {
    for (std::size_t i = 0; i * stride < words.size(); ++i) {
        const double size = norm(quaternion_at(words, i * stride));
        if (!(std::abs(size - 1) < 1e-3))
            throw InputError(fmt::format("{}: quaternion {} of {} has length {}, 1 is expected", place, i + 1,
                                         words.size() / stride, size));
    }
}

/// Type 1.
class Instants final : public CkData {
public:
    Instants(const std::string& place, bool rates, std::span<const double> words) : stride_(rates ? 7 : 4) {
        const std::size_t count =
            words.empty() ? 0 : count_in(place, words.back(), words.size(), "attitudes");
        if (count == 0 || count * (stride_ + 1) + directory_size(count) + 1 != words.size())
            throw InputError(
                fmt::format("{}: {} attitudes do not fit into {} values", place, count, words.size()));
        attitudes_ = words.first(count * stride_);
        times_ = words.subspan(attitudes_.size(), count);
        require_increasing(place, times_, false, "time");
        require_quaternions(place, attitudes_, stride_);
    }

    [[nodiscard]] std::vector<Interval> coverage() const override {
        std::vector<Interval> instants;
        for (const double time : times_)
            instants.push_back({time, time});
        return instants;
    }
    [[nodiscard]] Evaluation attitude(double ticks, Quat& from_base) const noexcept override {
        const auto at = std::lower_bound(times_.begin(), times_.end(), ticks);
        if (at == times_.end() || *at != ticks) return Evaluation::no_coverage;
        from_base = quaternion_at(attitudes_, static_cast<std::size_t>(at - times_.begin()) * stride_);
        return Evaluation::ok;
    }

private:
    std::size_t stride_;
    std::span<const double> attitudes_, times_;
};

/// Type 2: an attitude, an angular rate in the base frame, rad/s, and the seconds of a tick.
class ConstantRates final : public CkData {
public:
    ConstantRates(const std::string& place, std::span<const double> words) {
        // 10 values for each interval, and a directory of every hundredth start.
        const std::size_t count = words.empty() ? 0 : (words.size() - (words.size() - 1) / 1001) / 10;
        if (count == 0 || 10 * count + directory_size(count) != words.size())
            throw InputError(fmt::format("{}: {} values are no intervals of 10", place, words.size()));
        records_ = words.first(record_words * count);
        starts_ = words.subspan(records_.size(), count);
        stops_ = words.subspan(records_.size() + count, count);
        require_increasing(place, starts_, true, "start");
        require_increasing(place, stops_, true, "stop");
        for (std::size_t i = 0; i < count; ++i)
            if (stops_[i] < starts_[i] || (i > 0 && starts_[i] < stops_[i - 1]))
                throw InputError(
                    fmt::format("{}: interval {} from {} to {} ticks", place, i + 1, starts_[i], stops_[i]));
        require_quaternions(place, records_, record_words);
    }

    [[nodiscard]] std::vector<Interval> coverage() const override {
        std::vector<Interval> covered;
        for (std::size_t i = 0; i < starts_.size(); ++i)
            covered.push_back({starts_[i], stops_[i]});
        return covered;
    }
    [[nodiscard]] Evaluation attitude(double ticks, Quat& from_base) const noexcept override {
        const auto after = std::upper_bound(starts_.begin(), starts_.end(), ticks);
        if (after == starts_.begin()) return Evaluation::no_coverage;
        const auto index = static_cast<std::size_t>(after - starts_.begin()) - 1;
        if (ticks > stops_[index]) return Evaluation::no_coverage;
        const std::span<const double> record = records_.subspan(index * record_words, record_words);
        const Vec3 rate{record[4], record[5], record[6]};
        from_base = quaternion_at(record, 0);
        const double speed = length(rate);
        // The instrument's axes turn by the rate in the base frame.
        if (speed > 0)
            from_base = from_base * axis_angle(rate / speed, -speed * (ticks - starts_[index]) * record[7]);
        return Evaluation::ok;
    }

private:
    static constexpr std::size_t record_words = 8;
    std::span<const double> records_, starts_, stops_;
};

/// Type 3: at constant rate between attitudes of an interval.
class LinearAttitudes final : public CkData {
public:
    LinearAttitudes(const std::string& place, bool rates, std::span<const double> words)
        : stride_(rates ? 7 : 4) {
        if (words.size() < 2) throw InputError(fmt::format("{}: {} values", place, words.size()));
        // Attitudes; times and directory; starts of intervals and directory; counts.
        const std::size_t count = count_in(place, words.back(), words.size(), "attitudes");
        const std::size_t intervals = count_in(place, words[words.size() - 2], count, "intervals");
        const std::size_t times_at = count * stride_;
        const std::size_t starts_at = times_at + count + directory_size(count);
        if (starts_at + intervals + directory_size(intervals) + 2 != words.size())
            throw InputError(fmt::format("{}: {} attitudes in {} intervals do not fit into {} values", place,
                                         count, intervals, words.size()));
        attitudes_ = words.first(times_at);
        times_ = words.subspan(times_at, count);
        starts_ = words.subspan(starts_at, intervals);
        require_increasing(place, times_, true, "time");
        require_increasing(place, starts_, true, "interval");
        if (starts_.front() > times_.front())
            throw InputError(fmt::format("{}: the first interval starts after the first attitude", place));
        require_quaternions(place, attitudes_, stride_);
    }

    [[nodiscard]] std::vector<Interval> coverage() const override {
        std::vector<Interval> covered;
        for (std::size_t i = 0; i < starts_.size(); ++i) {
            const auto next = i + 1 < starts_.size()
                                  ? std::lower_bound(times_.begin(), times_.end(), starts_[i + 1])
                                  : times_.end();
            const double last = next == times_.begin() ? starts_[i] : *(next - 1);
            const double first = std::max(starts_[i], times_.front());
            if (first <= last) covered.push_back({first, last});
        }
        return covered;
    }
    [[nodiscard]] Evaluation attitude(double ticks, Quat& from_base) const noexcept override {
        const auto after = std::upper_bound(times_.begin(), times_.end(), ticks);
        if (after == times_.begin()) return Evaluation::no_coverage;
        const auto index = static_cast<std::size_t>(after - times_.begin()) - 1;
        if (times_[index] == ticks) {
            from_base = normalized(sample(index));
            return Evaluation::ok;
        }
        if (after == times_.end()) return Evaluation::no_coverage;
        // A start of an interval after `ticks` and no later than the next attitude: a gap.
        const auto start = std::upper_bound(starts_.begin(), starts_.end(), ticks);
        if (start != starts_.end() && *start <= *after) return Evaluation::no_coverage;
        const double share = (ticks - times_[index]) / (*after - times_[index]);
        from_base = slerp(normalized(sample(index)), normalized(sample(index + 1)), share);
        return Evaluation::ok;
    }

private:
    [[nodiscard]] Quat sample(std::size_t index) const noexcept {
        return quaternion_at(attitudes_, index * stride_);
    }

    std::size_t stride_;
    std::span<const double> attitudes_, times_, starts_;
};

} // namespace

std::shared_ptr<const CkData> make_ck_attitudes(const std::string& place, std::int32_t type, bool rates,
                                                std::span<const double> words) {
    switch (type) {
    case 1:
        return std::make_shared<Instants>(place, rates, words);
    case 2:
        return std::make_shared<ConstantRates>(place, words);
    default:
        return std::make_shared<LinearAttitudes>(place, rates, words);
    }
}

} // namespace obscura::ephemeris
