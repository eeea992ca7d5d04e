// SPDX-License-Identifier: Apache-2.0
// Particle hits (cosmic rays, protons): position, time and charge of their tracks.
#pragma once

#include "core/camera/frame.hpp"
#include "core/time.hpp"
#include "sensors/description.hpp"
#include "sensors/kernels.hpp"

#include <array>
#include <cstdint>

namespace obscura::sensors {

/// Particle hits of a frame, drawn per strip of rows, so that a block of rows draws its own hits
/// independently of the others. Reentrant; does not allocate.
///
/// Count: Poisson(flux area time). Directions: isotropic flux through a plane, p(cos) = 2 cos. Charge: the
/// path through the layer times the mean per length, with Moyal's approximation of the Landau straggling
/// (width 0.2 of the mean) - J. Moyal, Phil. Mag. 46 (1955).
class ParticleFlux {
public:
    explicit ParticleFlux(const SensorDescription& description) noexcept;

    [[nodiscard]] bool none() const noexcept { return flux_per_px_s_ <= 0; }

    /// Calls `visit(hit)` for every hit of the frame, between `begin` and `end`, that may touch a row of
    /// [first_row, first_row + rows). `key`: of the temporal noise.
    template<class Visit>
    void each(std::uint64_t key, std::uint64_t frame, Time begin, Time end, std::int32_t first_row,
              std::int32_t rows, Visit visit) const noexcept {
        const std::int32_t first = (first_row - reach_px) / strip_rows - 1;
        const std::int32_t last = (first_row + rows + reach_px) / strip_rows;
        std::array<float, counted_strips + kernels::padding> counts;
        std::int32_t counted_from = -counted_strips;
        for (std::int32_t strip = first < 0 ? 0 : first; strip <= last && strip * strip_rows < height_;
             ++strip) {
            if (strip >= counted_from + counted_strips || strip < counted_from) {
                counted_from = strip;
                count_in(key, frame, end - begin, strip, counts);
            }
            const auto count =
                static_cast<std::uint32_t>(counts[static_cast<std::size_t>(strip - counted_from)]);
            for (std::uint32_t i = 0; i < count; ++i)
                visit(hit(key, frame, begin, end - begin, strip, i));
        }
    }

    static constexpr std::int32_t strip_rows = 16;
    static constexpr std::int32_t reach_px = 48; ///< longest track across the array; longer tracks are cut

private:
    static constexpr std::int32_t counted_strips = 16; ///< strips whose counts are drawn together
    void count_in(std::uint64_t key, std::uint64_t frame, std::int64_t span_ns, std::int32_t first_strip,
                  std::array<float, counted_strips + kernels::padding>& counts) const noexcept;
    [[nodiscard]] ParticleHit hit(std::uint64_t key, std::uint64_t frame, Time begin, std::int64_t span_ns,
                                  std::int32_t strip, std::uint32_t index) const noexcept;

    std::int32_t width_, height_;
    double flux_per_px_s_;
    double depth_px_;        ///< in pitches of the columns
    double rows_per_column_; ///< pitch of the columns over that of the rows
    double charge_e_;        ///< mean, for a track normal to the layer
};

/// Adds the charge that the hit leaves in `charge`, a row of `n` pixels from column `x0` of array row `y` on.
void deposit(const ParticleHit& hit, std::int32_t y, std::int32_t x0, std::int32_t n, float* charge) noexcept;

} // namespace obscura::sensors
