// Cosmic rays and protons: where and when they cross the array and what charge they leave along their tracks.
#pragma once

#include "core/sensor_description.hpp"
#include "core/time.hpp"

#include <cstdint>

namespace obscura::sensors {

/// One particle through the sensitive layer. Pixels are counted from the outer corner of pixel (0, 0).
struct ParticleHit {
    Time time;
    double x_px = 0, y_px = 0;   ///< where it enters
    double dx_px = 0, dy_px = 0; ///< across the array on its way through the layer
    double charge_e = 0;         ///< along the whole track
};

/// Hits of one frame, drawn strip by strip so that any band of rows finds its own without the others.
///
/// Count: Poisson(flux area time). Directions: isotropic flux through a plane, p(cos) = 2 cos. Charge: the
/// path through the layer times the mean per length, with Moyal's approximation of the Landau straggling
/// (width 0.2 of the mean) - J. Moyal, Phil. Mag. 46 (1955).
class ParticleRain {
public:
    ParticleRain(const SensorDescription& description, std::uint64_t key) noexcept;

    [[nodiscard]] bool none() const noexcept { return flux_per_px_s_ <= 0; }

    /// Calls `visit(hit)` for every hit of the frame, between `begin` and `end`, that may touch a row of
    /// [first_row, first_row + rows).
    template<class Visit>
    void each(std::uint64_t frame, Time begin, Time end, std::int32_t first_row, std::int32_t rows,
              Visit visit) const noexcept {
        const std::int32_t first = (first_row - reach_px) / strip_rows - 1;
        const std::int32_t last = (first_row + rows + reach_px) / strip_rows;
        for (std::int32_t strip = first < 0 ? 0 : first; strip <= last && strip * strip_rows < height_;
             ++strip) {
            const std::uint32_t count = count_in(frame, end - begin, strip);
            for (std::uint32_t i = 0; i < count; ++i)
                visit(hit(frame, begin, end - begin, strip, i));
        }
    }

    static constexpr std::int32_t strip_rows = 16;
    static constexpr std::int32_t reach_px = 48; ///< longest track across the array; longer ones are cut

private:
    [[nodiscard]] std::uint32_t count_in(std::uint64_t frame, std::int64_t span_ns,
                                         std::int32_t strip) const noexcept;
    [[nodiscard]] ParticleHit hit(std::uint64_t frame, Time begin, std::int64_t span_ns, std::int32_t strip,
                                  std::uint32_t index) const noexcept;

    std::uint64_t key_;
    std::int32_t width_, height_;
    double flux_per_px_s_;
    double depth_px_;
    double charge_e_; ///< mean, for a track straight through the layer
};

/// Adds to `charge`, a row of `n` pixels that starts at column `x0` of array row `y`, what the hit leaves
/// there.
void deposit(const ParticleHit& hit, std::int32_t y, std::int32_t x0, std::int32_t n, float* charge) noexcept;

} // namespace obscura::sensors
