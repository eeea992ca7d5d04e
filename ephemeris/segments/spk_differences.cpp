// SPDX-License-Identifier: Apache-2.0
// SPK types 1 and 21: modified difference lines.
#include "core/error.hpp"
#include "ephemeris/segments/interpolation.hpp"
#include "ephemeris/segments/segment_data.hpp"
#include "ephemeris/segments/spk_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace obscura::ephemeris {
namespace {

class DifferenceLines final : public SpkData {
public:
    DifferenceLines(const std::string& place, std::int32_t type, std::span<const double> words)
        : words_(words) {
        // At the end: type 1 the number of records; type 21 the orders of a difference line before it.
        const std::size_t tail = type == 1 ? 1 : 2;
        if (words.size() <= tail) throw InputError(fmt::format("{}: {} values", place, words.size()));
        const std::size_t count = count_in(place, words.back(), words.size(), "records");
        differences_ = type == 1 ? 15
                                 : count_in(place, words[words.size() - 2], max_differences,
                                            "orders of a difference line");
        record_words_ = 4 * differences_ + 11;
        // Both types have a directory of every hundredth time, also where the last time is one.
        if (count * (record_words_ + 1) + count / 100 + tail != words.size())
            throw InputError(fmt::format("{}: {} difference lines of {} values do not fit into {} values",
                                         place, count, record_words_, words.size()));
        times_ = words.subspan(count * record_words_, count);
        require_increasing(place, times_, true, "time");
    }

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        // A record holds up to its time, from that of the one before it.
        const auto after = std::lower_bound(times_.begin(), times_.end(), time.seconds());
        const auto index = std::min(static_cast<std::size_t>(after - times_.begin()), times_.size() - 1);
        ValueAndRate axes[3];
        if (!difference_line(words_.subspan(index * record_words_, record_words_), differences_, time, axes))
            return false;
        state = {{axes[0].value, axes[1].value, axes[2].value}, {axes[0].rate, axes[1].rate, axes[2].rate}};
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override {
        return {-std::numeric_limits<double>::infinity(), times_.back()};
    }

private:
    std::span<const double> words_, times_;
    std::size_t record_words_ = 0, differences_ = 0;
};

} // namespace

std::shared_ptr<const SpkData> make_spk_differences(const std::string& place, std::int32_t type,
                                                    std::span<const double> words) {
    return std::make_shared<DifferenceLines>(place, type, words);
}

} // namespace obscura::ephemeris
