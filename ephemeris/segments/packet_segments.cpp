// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/segments/packet_segments.hpp"

#include "core/error.hpp"
#include "ephemeris/segments/segment_data.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::ephemeris {

void set_packet_subtype(const std::string& place, std::span<const PacketSubtype> subtypes, double subtype,
                        double window, TypedPackets& packets) {
    if (!(subtype >= 0 && subtype < static_cast<double>(subtypes.size())) ||
        subtype != static_cast<double>(static_cast<std::uint8_t>(subtype)))
        throw InputError(fmt::format("{}: subtype {}, allowed 0 to {}", place, subtype, subtypes.size() - 1));
    packets.subtype = static_cast<std::uint8_t>(subtype);
    const PacketSubtype& known = subtypes[packets.subtype];
    packets.samples.packet_words = known.words;
    packets.samples.window =
        count_in(place, window, known.hermite ? max_samples / 2 : max_samples, "samples of a window");
}

TypedPackets typed_packets(const std::string& place, std::span<const double> words,
                           std::span<const PacketSubtype> subtypes, bool clock_rate) {
    const std::size_t tail_words = clock_rate ? 4 : 3;
    if (words.size() <= tail_words) throw InputError(fmt::format("{}: {} values", place, words.size()));
    const std::span<const double> tail = words.last(3);
    TypedPackets packets;
    set_packet_subtype(place, subtypes, tail[0], tail[1], packets);
    SampledPackets& samples = packets.samples;
    samples.count = count_in(place, tail[2], words.size(), "packets");
    if (clock_rate) packets.seconds_per_tick = words[words.size() - tail_words];
    if (!(packets.seconds_per_tick > 0))
        throw InputError(fmt::format("{}: {} s for a tick of the clock", place, packets.seconds_per_tick));
    const std::size_t values = samples.count * samples.packet_words;
    if (values + samples.count + directory_size(samples.count) + tail_words != words.size())
        throw InputError(fmt::format("{}: {} packets of {} values do not fit into {} values", place,
                                     samples.count, samples.packet_words, words.size()));
    samples.values = words.first(values);
    samples.times = words.subspan(values, samples.count);
    require_increasing(place, samples.times, true, "time");
    return packets;
}

MiniSegments::MiniSegments(const std::string& place, std::span<const double> words,
                           std::span<const PacketSubtype> subtypes, bool clock_rate) {
    if (words.size() < 2) throw InputError(fmt::format("{}: {} values", place, words.size()));
    const std::size_t count = count_in(place, words.back(), words.size(), "mini-segments");
    const double flag = words[words.size() - 2];
    if (flag != 0 && flag != 1)
        throw InputError(fmt::format("{}: {} as choice at boundaries, allowed 0, 1", place, flag));
    later_at_bounds_ = flag == 1;
    // Mini-segments; bounds and their directory; pointers, from 1; flag and count.
    const std::size_t bounds = count + 1, directory = count / 100;
    const std::size_t behind = bounds + directory + bounds + 2;
    if (behind > words.size())
        throw InputError(
            fmt::format("{}: {} mini-segments do not fit into {} values", place, count, words.size()));
    const std::span<const double> data = words.first(words.size() - behind);
    bounds_ = words.subspan(data.size(), bounds);
    require_increasing(place, bounds_, true, "boundary");
    const std::span<const double> pointers = words.subspan(data.size() + bounds + directory, bounds);
    std::size_t from = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const std::string own = fmt::format("{}: mini-segment {}", place, i + 1);
        const std::size_t begin = count_in(own, pointers[i], data.size() + 1, "as start");
        const std::size_t end = count_in(own, pointers[i + 1], data.size() + 1, "as end");
        if (begin != from + 1 || end <= begin)
            throw InputError(fmt::format("{}: from value {} to {}, after {}", own, begin, end, from));
        pieces_.push_back(typed_packets(own, data.subspan(begin - 1, end - begin), subtypes, clock_rate));
        from = end - 1;
        const SampledPackets& samples = pieces_.back().samples;
        if (samples.times.front() > bounds_[i])
            throw InputError(fmt::format("{}: starts at {:.17g}, after the boundary {:.17g}", own,
                                         samples.times.front(), bounds_[i]));
    }
}

std::size_t MiniSegments::index(double t) const noexcept {
    const auto after = later_at_bounds_ ? std::upper_bound(bounds_.begin(), bounds_.end(), t)
                                        : std::lower_bound(bounds_.begin(), bounds_.end(), t);
    const auto bound = static_cast<std::size_t>(after - bounds_.begin());
    return std::min(bound == 0 ? 0 : bound - 1, pieces_.size() - 1);
}

} // namespace obscura::ephemeris
