// SPDX-License-Identifier: Apache-2.0
// Segments made of mini-segments, each with packets of its own: SPK type 19 and CK type 6.
#pragma once

#include "ephemeris/segments/sampled_packets.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace obscura::ephemeris {

/// How the packets of a subtype are interpolated.
struct PacketSubtype {
    std::size_t words = 0;
    bool hermite = false;
};

/// Packets with the subtype that tells how to interpolate them.
struct TypedPackets {
    SampledPackets samples;
    std::uint8_t subtype = 0;
    double seconds_per_tick = 1; ///< CK
};

/// Reads packets, times, a directory of times, `rate_words` numbers of which the first is a clock's rate (0:
/// none), subtype, window and number of packets. Throws InputError naming `place`.
[[nodiscard]] TypedPackets typed_packets(const std::string& place, std::span<const double> words,
                                         std::span<const PacketSubtype> subtypes, bool clock_rate);
/// Checks subtype and window, and sets both. Throws InputError naming `place`.
void set_packet_subtype(const std::string& place, std::span<const PacketSubtype> subtypes, double subtype,
                        double window, TypedPackets& packets);

/// Mini-segments in the order of their times.
class MiniSegments {
public:
    /// Throws InputError naming `place`.
    MiniSegments(const std::string& place, std::span<const double> words,
                 std::span<const PacketSubtype> subtypes, bool clock_rate);

    [[nodiscard]] double begin() const noexcept { return bounds_.front(); }
    [[nodiscard]] double end() const noexcept { return bounds_.back(); }
    [[nodiscard]] std::size_t size() const noexcept { return pieces_.size(); }
    /// Mini-segment that holds at `t`; at a boundary the one that the segment's flag chooses. Real-time safe.
    [[nodiscard]] std::size_t index(double t) const noexcept;
    [[nodiscard]] const TypedPackets& operator[](std::size_t index) const noexcept { return pieces_[index]; }
    [[nodiscard]] double start_of(std::size_t index) const noexcept { return bounds_[index]; }
    [[nodiscard]] double stop_of(std::size_t index) const noexcept { return bounds_[index + 1]; }

private:
    std::vector<TypedPackets> pieces_;
    std::span<const double> bounds_; ///< one more than there are pieces
    bool later_at_bounds_ = true;
};

} // namespace obscura::ephemeris
