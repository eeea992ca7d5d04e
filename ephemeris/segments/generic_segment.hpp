// SPDX-License-Identifier: Apache-2.0
// Generic segment of a DAF: constants, packets and a reference value of each (NAIF, SPK Required Reading).
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace obscura::ephemeris {

/// Layout of SPK types 10 and 14 and CK type 4. The data must outlive it. Immutable, thread-safe.
class GenericSegment {
public:
    GenericSegment() = default;
    /// Throws InputError naming `place` for partitions outside the segment, and for reference values that
    /// are not one for each packet in increasing order.
    GenericSegment(const std::string& place, std::span<const double> words);

    [[nodiscard]] std::span<const double> constants() const noexcept { return constants_; }
    [[nodiscard]] std::size_t size() const noexcept { return references_.size(); }
    [[nodiscard]] std::span<const double> packet(std::size_t index) const noexcept;
    [[nodiscard]] std::span<const double> references() const noexcept { return references_; }

private:
    std::span<const double> packets_, constants_, references_;
    std::span<const double> starts_; ///< packets of variable size: starts from 1, and the end; else empty
    std::size_t packet_words_ = 0, offset_ = 0;
};

} // namespace obscura::ephemeris
