// SPDX-License-Identifier: Apache-2.0
// Star catalogue file: a table of stars sorted by sky cell and magnitude.
//
// Layout, little endian. Header of 256 bytes:
//
//   offset type   content
//        0 8 x u8 "OBSTARS" and a line feed
//        8 u32    version, 1
//       12 u32    bytes of the header, 256
//       16 u32    bytes of a record, 36
//       20 u32    sky cells along the edge of a cube face (ephemeris/stars/sky_cells.hpp)
//       24 u64    stars
//       32 u64    bytes of the file
//       40 i32    V of the brightest star, mmag; 0 without stars
//       44 i32    V of the faintest one
//       48 i32    V to which the makers expect it to be complete, mmag; -2^31: not known
//       52 u32    largest proper motion, uas/yr, rounded up
//       56 u32    largest parallax, uas, rounded up
//       60 u32    CRC-32 (as of zlib) of the records
//       64 160 x u8 source in UTF-8, padded with zeros
//      252 u32    CRC-32 of the 252 bytes before and of the index
//
// Index: for each sky cell the number of its first record, and the number of stars: cells + 1 times u32.
// Records, those of a cell by ascending V:
//
//        0 u32    u of the face point at J2000.0: (u + 1) / 2 in units of 2^-32
//        4 u32    v
//        8 i32    proper motion in right ascension times cos(declination), uas/yr
//       12 i32    proper motion in declination
//       16 i32    parallax, uas
//       20 u64    identifier
//       28 i16    V, mmag
//       30 i16    B-V, mmag; -2^15: not known
//       32 u16    spectral type: 0: not known, else 1 + hundredths of CatalogueStar::type_number (at most
//                 6.99) + 1000 times the luminosity class
//       34 u8     bits 0..2: face; bits 4..7: kind of the identifier
//       35 u8     luminosity class of a star whose spectral type is not known (else 0)
//
// Directions are within 0.07 mas of those that were written.
#pragma once

#include "ephemeris/stars/sky_cells.hpp"
#include "ephemeris/stars/star.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::ephemeris {

/// Reader of a star catalogue file. Whatever the file holds, what it gives are stars with finite numbers;
/// a damaged one is refused, but for damage to the records, which intact() finds. Immutable; thread-safe.
class StarFile {
public:
    /// Maps `file` into memory. Throws InputError `file: what is wrong, what is allowed`.
    explicit StarFile(const std::filesystem::path& file);
    /// Reads a copy; `name` is that of the file in messages.
    StarFile(std::span<const std::byte> bytes, const std::string& name);

    /// Whether `file` begins as such a file does; false if it cannot be read.
    [[nodiscard]] static bool is_one(const std::filesystem::path& file);

    [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
    [[nodiscard]] const std::string& source() const noexcept { return source_; }
    [[nodiscard]] double brightest_v() const noexcept { return brightest_v_; }
    [[nodiscard]] double faintest_v() const noexcept { return faintest_v_; }
    [[nodiscard]] std::optional<double> complete_v() const noexcept { return complete_v_; }
    [[nodiscard]] double largest_motion_mas_yr() const noexcept { return largest_motion_mas_yr_; }
    [[nodiscard]] double largest_parallax_mas() const noexcept { return largest_parallax_mas_; }
    [[nodiscard]] std::size_t bytes() const noexcept { return bytes_.size(); }
    [[nodiscard]] const SkyCells& cells() const noexcept { return *cells_; }
    /// Whether the records have the checksum of the header. Reads the whole file.
    [[nodiscard]] bool intact() const;

    /// `number`: below size().
    [[nodiscard]] CatalogueStar star(std::uint32_t number) const noexcept;
    /// J2000.0 direction of a star.
    [[nodiscard]] Vec3 direction(std::uint32_t number) const noexcept;
    [[nodiscard]] double magnitude_v(std::uint32_t number) const noexcept;

    /// Finds the stars not fainter than `limiting_v` whose direction at J2000.0 is within the cone, by
    /// ascending number. Fills `found` with the first of them and returns how many there are. Real-time safe.
    std::size_t find(const SkyCells::Cone& cone, double limiting_v,
                     std::span<std::uint32_t> found) const noexcept;
    /// Calls `use(number)` for each of these stars, with ascending numbers. Real-time safe if `use` is.
    template<typename Use>
    void for_each(const SkyCells::Cone& cone, double limiting_v, const Use& use) const {
        const double limit = min_cosine(cone);
        cells_->for_each_near(cone, [&](std::uint32_t cell) {
            const std::uint32_t end = first_of(cell + 1);
            for (std::uint32_t i = first_of(cell); i < end; ++i) {
                if (magnitude_v(i) > limiting_v) break; // those of a cell are sorted
                if (dot(cone.axis, direction(i)) >= limit) use(i);
            }
        });
    }
    /// Angle by which find() has to look farther than the field `years` after J2000.0 for an observer at
    /// `observer_au` from the barycentre: largest motion and parallax of the stars.
    [[nodiscard]] double largest_shift_rad(double years, Vec3 observer_au) const noexcept;

private:
    void read(const std::string& name);
    [[nodiscard]] const std::byte* record(std::uint32_t number) const noexcept;
    [[nodiscard]] std::uint32_t first_of(std::uint32_t cell) const noexcept;
    /// Cosine of a cone's half angle, less what its rounding may be.
    [[nodiscard]] static double min_cosine(const SkyCells::Cone& cone) noexcept;

    std::shared_ptr<const void> memory_; ///< keeps bytes_
    std::span<const std::byte> bytes_;
    std::shared_ptr<const SkyCells> cells_;
    std::uint32_t size_ = 0;
    std::string source_;
    double brightest_v_ = 0, faintest_v_ = 0;
    std::optional<double> complete_v_;
    double largest_motion_mas_yr_ = 0, largest_parallax_mas_ = 0;
};

/// Limits of what a record holds.
inline constexpr double max_magnitude = 32.767;
inline constexpr double max_motion_mas_yr = 2'000'000, max_parallax_mas = 2'000'000;
inline constexpr std::size_t max_source_bytes = 160;

/// Bytes of a star catalogue file. `source`: what the stars are from; cut to max_source_bytes. Throws
/// InputError if a star's number is outside the limits of a record, naming its place in `stars`.
[[nodiscard]] std::vector<std::byte> star_file_bytes(std::span<const CatalogueStar> stars,
                                                     std::string_view source,
                                                     std::optional<double> complete_v);

} // namespace obscura::ephemeris
