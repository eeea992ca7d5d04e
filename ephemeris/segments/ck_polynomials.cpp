// SPDX-License-Identifier: Apache-2.0
// CK types 4, 5 and 6: Chebyshev series, and polynomials through packets.
#include "core/error.hpp"
#include "ephemeris/segments/ck_data.hpp"
#include "ephemeris/segments/generic_segment.hpp"
#include "ephemeris/segments/packet_segments.hpp"
#include "ephemeris/segments/segment_data.hpp"
#include "ephemeris/segments/segment_timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace obscura::ephemeris {
namespace {

/// Type 4: series of the quaternion's components, and of the angular rate, which are not needed.
class SeriesAttitudes final : public CkData {
public:
    SeriesAttitudes(const std::string& place, std::span<const double> words) : segment_(place, words) {
        for (std::size_t i = 0; i < segment_.size(); ++i) {
            const std::span<const double> packet = segment_.packet(i);
            std::array<std::size_t, components> sizes{};
            if (packet.size() < header_words || !(packet[1] >= 0) || !std::isfinite(packet[0]) ||
                !std::isfinite(packet[1]) || !sizes_of(packet, sizes))
                throw InputError(fmt::format("{}: packet {} of {} values holds no series of a quaternion",
                                             place, i + 1, packet.size()));
        }
    }

    [[nodiscard]] std::vector<Interval> coverage() const override {
        std::vector<Interval> covered;
        for (std::size_t i = 0; i < segment_.size(); ++i) {
            const std::span<const double> packet = segment_.packet(i);
            covered.push_back({packet[0] - packet[1], packet[0] + packet[1]});
        }
        return covered;
    }
    [[nodiscard]] Evaluation attitude(double ticks, Quat& from_base) const noexcept override {
        const std::span<const double> starts = segment_.references();
        const auto after = std::upper_bound(starts.begin(), starts.end(), ticks);
        if (after == starts.begin()) return Evaluation::no_coverage;
        const std::span<const double> packet =
            segment_.packet(static_cast<std::size_t>(after - starts.begin()) - 1);
        const double from_middle = ticks - packet[0];
        if (std::abs(from_middle) > packet[1]) return Evaluation::no_coverage;
        std::array<std::size_t, components> sizes{};
        if (!sizes_of(packet, sizes)) return Evaluation::damaged;
        const double x = packet[1] > 0 ? from_middle / packet[1] : 0;
        std::array<double, 4> q{};
        std::size_t at = header_words;
        for (std::size_t i = 0; i < 4; ++i) {
            q[i] = chebyshev(packet.subspan(at, sizes[i]), x).value;
            at += sizes[i];
        }
        from_base = {q[0], q[1], q[2], q[3]};
        return Evaluation::ok;
    }

private:
    /// Middle, radius, and the packed numbers of coefficients.
    static constexpr std::size_t header_words = 3, components = 7;

    /// Numbers of coefficients, digits to the base 128, the last component first. False: they do not fit.
    static bool sizes_of(std::span<const double> packet,
                         std::array<std::size_t, components>& sizes) noexcept {
        constexpr double largest = 562949953421312; // 128^7
        constexpr std::uint64_t base = 128;
        if (!(packet[2] >= 0 && packet[2] < largest)) return false;
        auto packed = static_cast<std::uint64_t>(packet[2]);
        std::size_t sum = 0;
        for (std::size_t& size : sizes) {
            size = static_cast<std::size_t>(packed % base);
            packed /= base;
            sum += size;
        }
        return sizes[0] > 0 && sizes[1] > 0 && sizes[2] > 0 && sizes[3] > 0 &&
               header_words + sum <= packet.size();
    }

    GenericSegment segment_;
};

/// Subtypes of types 5 and 6: quaternion and derivative; quaternion; both with angular rate and its
/// derivative; quaternion and angular rate. Derivatives are by seconds.
constexpr std::array attitude_subtypes{PacketSubtype{8, true}, PacketSubtype{4, false},
                                       PacketSubtype{14, true}, PacketSubtype{7, false}};

/// Quaternion at `ticks`, between samples `low` and `low` + 1, by samples `begin` to `end` - 1.
Quat interpolated_attitude(const TypedPackets& packets, double ticks, std::size_t low, std::size_t begin,
                           std::size_t end) noexcept {
    const SampledPackets& samples = packets.samples;
    const SampleWindow window = shrunk_window(samples, low, begin, end);
    const bool with_rates = attitude_subtypes[packets.subtype].hermite;
    std::array<double, max_samples> nodes, values, rates;
    std::array<double, max_samples> signs;
    for (std::size_t i = 0; i < window.count; ++i) {
        nodes[i] = samples.time(window.first + i) - ticks;
        // A quaternion and its negative are one attitude: take the one nearer to the sample before.
        signs[i] = 1;
        if (i == 0) continue;
        const std::span<const double> own = samples.packet(window.first + i);
        const std::span<const double> before = samples.packet(window.first + i - 1);
        double product = 0;
        for (std::size_t k = 0; k < 4; ++k)
            product += own[k] * before[k];
        signs[i] = product < 0 ? -signs[i - 1] : signs[i - 1];
    }
    const auto used = [&](const std::array<double, max_samples>& all) {
        return std::span<const double>(all).first(window.count);
    };
    std::array<double, 4> q{};
    for (std::size_t k = 0; k < 4; ++k) {
        for (std::size_t i = 0; i < window.count; ++i) {
            const std::span<const double> packet = samples.packet(window.first + i);
            values[i] = signs[i] * packet[k];
            rates[i] = with_rates ? signs[i] * packet[k + 4] * packets.seconds_per_tick : 0;
        }
        q[k] = with_rates ? hermite(used(nodes), used(values), used(rates)).value
                          : lagrange(used(nodes), used(values)).value;
    }
    return {q[0], q[1], q[2], q[3]};
}

Quat sampled_attitude(const TypedPackets& packets, std::size_t index) noexcept {
    const std::span<const double> packet = packets.samples.packet(index);
    return {packet[0], packet[1], packet[2], packet[3]};
}

/// Type 5: packets in intervals without a gap.
class PacketAttitudes final : public CkData {
public:
    PacketAttitudes(const std::string& place, std::span<const double> words) {
        // Packets, times and directory, starts of intervals and directory; seconds of a tick, subtype,
        // window, intervals, packets.
        constexpr std::size_t tail_words = 5;
        if (words.size() <= tail_words) throw InputError(fmt::format("{}: {} values", place, words.size()));
        const std::span<const double> tail = words.last(tail_words);
        set_packet_subtype(place, attitude_subtypes, tail[1], tail[2], packets_);
        packets_.seconds_per_tick = tail[0];
        SampledPackets& samples = packets_.samples;
        samples.count = count_in(place, tail[4], words.size(), "packets");
        const std::size_t intervals = count_in(place, tail[3], samples.count, "intervals");
        const std::size_t values = samples.count * samples.packet_words;
        const std::size_t starts_at = values + samples.count + directory_size(samples.count);
        if (starts_at + intervals + directory_size(intervals) + tail_words != words.size())
            throw InputError(fmt::format("{}: {} packets in {} intervals do not fit into {} values", place,
                                         samples.count, intervals, words.size()));
        samples.values = words.first(values);
        samples.times = words.subspan(values, samples.count);
        starts_ = words.subspan(starts_at, intervals);
        require_increasing(place, samples.times, true, "time");
        require_increasing(place, starts_, true, "interval");
    }

    [[nodiscard]] std::vector<Interval> coverage() const override {
        std::vector<Interval> covered;
        const std::span<const double> times = packets_.samples.times;
        for (std::size_t i = 0; i < starts_.size(); ++i) {
            const auto [begin, end] = samples_from(i);
            if (begin < end) covered.push_back({times[begin], times[end - 1]});
        }
        if (covered.empty()) covered.push_back({times.front(), times.front()});
        return covered;
    }
    [[nodiscard]] Evaluation attitude(double ticks, Quat& from_base) const noexcept override {
        const SampledPackets& samples = packets_.samples;
        const std::size_t after = samples.samples_up_to(ticks);
        if (after == 0) return Evaluation::no_coverage;
        const std::size_t low = after - 1;
        if (samples.time(low) == ticks) {
            from_base = sampled_attitude(packets_, low);
            return Evaluation::ok;
        }
        const auto start = std::upper_bound(starts_.begin(), starts_.end(), ticks);
        if (after == samples.count || start == starts_.begin()) return Evaluation::no_coverage;
        const auto [begin, end] = samples_from(static_cast<std::size_t>(start - starts_.begin()) - 1);
        if (after >= end || low < begin) return Evaluation::no_coverage;
        from_base = interpolated_attitude(packets_, ticks, low, begin, end);
        return Evaluation::ok;
    }

private:
    /// First sample of an interval, and the one after its last.
    [[nodiscard]] std::pair<std::size_t, std::size_t> samples_from(std::size_t interval) const noexcept {
        const SampledPackets& samples = packets_.samples;
        return {samples.samples_up_to(starts_[interval], true),
                interval + 1 < starts_.size() ? samples.samples_up_to(starts_[interval + 1], true)
                                              : samples.count};
    }

    TypedPackets packets_;
    std::span<const double> starts_;
};

/// Type 6: mini-segments, each with a subtype and a clock rate of its own.
class PiecewiseAttitudes final : public CkData {
public:
    PiecewiseAttitudes(const std::string& place, std::span<const double> words)
        : pieces_(place, words, attitude_subtypes, true) {}

    [[nodiscard]] std::vector<Interval> coverage() const override {
        std::vector<Interval> covered;
        for (std::size_t i = 0; i < pieces_.size(); ++i)
            covered.push_back({pieces_.start_of(i), last_of(i)});
        return merged(std::move(covered));
    }
    [[nodiscard]] Evaluation attitude(double ticks, Quat& from_base) const noexcept override {
        const std::size_t index = pieces_.index(ticks);
        if (!(ticks >= pieces_.start_of(index) && ticks <= last_of(index))) return Evaluation::no_coverage;
        const TypedPackets& packets = pieces_[index];
        const SampledPackets& samples = packets.samples;
        const std::size_t low = samples.samples_up_to(ticks) - 1;
        from_base = samples.time(low) == ticks ? sampled_attitude(packets, low)
                                               : interpolated_attitude(packets, ticks, low, 0, samples.count);
        return Evaluation::ok;
    }

private:
    /// Last covered tick of a piece, whose packets may end before its interval.
    [[nodiscard]] double last_of(std::size_t index) const noexcept {
        return std::min(pieces_.stop_of(index), pieces_[index].samples.times.back());
    }

    MiniSegments pieces_;
};

} // namespace

std::shared_ptr<const CkData> make_ck_polynomials(const std::string& place, std::int32_t type,
                                                  std::span<const double> words) {
    switch (type) {
    case 4:
        return std::make_shared<SeriesAttitudes>(place, words);
    case 5:
        return std::make_shared<PacketAttitudes>(place, words);
    default:
        return std::make_shared<PiecewiseAttitudes>(place, words);
    }
}

} // namespace obscura::ephemeris
