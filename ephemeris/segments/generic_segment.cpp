// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/segments/generic_segment.hpp"

#include "core/error.hpp"
#include "ephemeris/segments/segment_data.hpp"

#include <fmt/format.h>

#include <cmath>

namespace obscura::ephemeris {
namespace {

/// Items of the meta data, which end the segment; the last is their number.
enum MetaItem : std::size_t {
    constants_base,
    constants_count,
    reference_base = 5,
    reference_count,
    directory_base,
    directory_count,
    directory_type,
    packets_base,
    packets_count,
    packet_size = 14,
    packet_offset,
    meta_count,
};
constexpr std::size_t max_meta = 100;

} // namespace

GenericSegment::GenericSegment(const std::string& place, std::span<const double> words) {
    const auto whole = [&](double value, std::size_t most, const char* what) {
        if (!(value >= 0 && value <= static_cast<double>(most)) || value != std::floor(value))
            throw InputError(fmt::format("{}: {} {}, allowed 0 to {}", place, value, what, most));
        return static_cast<std::size_t>(value);
    };
    const std::size_t items =
        words.empty() ? 0 : whole(words.back(), std::min(words.size(), max_meta), "items of meta data");
    if (items <= meta_count)
        throw InputError(fmt::format("{}: {} items of meta data, at least {} are needed", place, items,
                                     static_cast<std::size_t>(meta_count) + 1));
    const std::span<const double> meta = words.last(items);
    const std::span<const double> data = words.first(words.size() - items);
    const auto partition = [&](MetaItem base, std::size_t size, const char* what) {
        const std::size_t begin = whole(meta[base], data.size(), what);
        if (size > data.size() - begin)
            throw InputError(fmt::format("{}: {}: {} values from {} do not fit into {}", place, what, size,
                                         begin, data.size()));
        return data.subspan(begin, size);
    };
    const auto count = [&](MetaItem item, const char* what) { return whole(meta[item], data.size(), what); };
    constants_ = partition(constants_base, count(constants_count, "constants"), "constants");
    references_ = partition(reference_base, count(reference_count, "reference values"), "reference values");
    const std::size_t packets = count(packets_count, "packets");
    if (packets == 0 || references_.size() != packets)
        throw InputError(
            fmt::format("{}: {} packets with {} reference values, one for each packet is expected", place,
                        packets, references_.size()));
    require_increasing(place, references_, true, "reference value");
    packet_words_ = count(packet_size, "values of a packet");
    offset_ = count(packet_offset, "values before a packet");
    if (meta[directory_type] == 0) {
        packets_ = partition(packets_base, packets * (packet_words_ + offset_), "packets");
        return;
    }
    starts_ = partition(directory_base, count(directory_count, "packet directory"), "packet directory");
    if (starts_.size() != packets + 1)
        throw InputError(
            fmt::format("{}: {} packets with a directory of {}", place, packets, starts_.size()));
    const std::size_t begin = whole(meta[packets_base], data.size(), "packets");
    packets_ = data.subspan(begin);
    for (std::size_t i = 0; i < packets; ++i) {
        const std::size_t from = whole(starts_[i], packets_.size(), "start of a packet");
        const std::size_t to = whole(starts_[i + 1], packets_.size() + 1 + offset_, "end of a packet");
        if (from == 0 || to < from + offset_ || to - offset_ > packets_.size() + 1)
            throw InputError(fmt::format("{}: packet {} from {} to {}", place, i + 1, from, to));
    }
}

std::span<const double> GenericSegment::packet(std::size_t index) const noexcept {
    if (starts_.empty()) return packets_.subspan(index * (packet_words_ + offset_) + offset_, packet_words_);
    const auto from = static_cast<std::size_t>(starts_[index]);
    const auto to = static_cast<std::size_t>(starts_[index + 1]);
    return packets_.subspan(from - 1, to - from - offset_);
}

} // namespace obscura::ephemeris
