// SPDX-License-Identifier: Apache-2.0
// Block tracer: adaptive sampling of blocks of 16 neighbouring pixels of a row.
#pragma once

#include "renderer/camera/gaussian_psf.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/integrators/noise_estimate.hpp"
#include "renderer/integrators/sample_grid.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/world/instants.hpp"

#include <atomic>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Sampling parameters of a frame.
struct Sampling {
    std::uint64_t seed = 1;
    std::uint64_t frame_id = 0;
    std::uint32_t max_samples = 4; ///< per pixel, unless the row's bodies require more
    double target_error = 0;       ///< 0: the samples that the row's bodies require
    /// Upper limit of those where no body near is BodyState::small.
    std::uint32_t sample_limit = std::numeric_limits<std::uint32_t>::max();
    bool grid_only = false; ///< there, no samples beyond the shared grid
    /// Once it is true, pixels get no further samples: what they hold is of no use. Null: never.
    const std::atomic<bool>* cancel = nullptr;

    [[nodiscard]] bool is_cancelled() const noexcept {
        return cancel != nullptr && cancel->load(std::memory_order_relaxed);
    }
};

/// Means over the pixels of a block: radiance of the tracer times solid angle of the pixel.
struct BlockResult {
    bool covered[packet_size]; ///< false: no body is near, no ray was traced
    double mean[max_channels][packet_size];
    /// Estimated variance of the mean over the channels: for pixels that are filtered from the grid, and for
    /// the others on request.
    double variance[packet_size];
    std::uint32_t samples[packet_size];
};

/// Traces blocks of one row. A block starts at a multiple of 16 of the sensor's columns and is always traced
/// whole, so that a packet holds the same rays, and a pixel takes the same decisions, for any window.
///
/// Adaptive sampling in up to three rounds; a shared sample grid can replace the first. After each round a
/// pixel's spread is estimated from its own samples and those of its neighbours in the block; with
/// Owen-scrambled points the error of n samples falls as spread x n^-0.75 (between 1/n in smooth regions and
/// n^-0.7 on edges, measured), which gives the number of samples needed. The target error, root mean square
/// over the lit pixels, is `target_error` times the larger of the pixel's value and the reference radiance of
/// the body (BodyState::reference_radiance).
/// Light of several reflections or of area lights is noise of similar size in neighbouring pixels, rare and
/// strong, and falls as n^-0.55: there a pixel's error is at least that of its block, so that a few equal
/// samples do not end the sampling of a pixel, and its value is compared with the mean over the block as
/// well.
///
/// Where the row has several instants, each sample takes the one that the third dimension of its Sobol point
/// falls into: the samples of a pixel, and each aligned group of 2^k of them, are stratified in time together
/// with their places in the pixel, and the instants of neighbouring pixels are independent.
class BlockTracer {
public:
    /// All arguments must outlive the tracer, whose instants are `instants`. `candidates` is scratch space.
    /// `swept`: see join_instants(). `projection`: with aberration if the row has one instant, without if it
    /// has several.
    BlockTracer(const Projection& projection, const GaussianPsf& gaussian_psf, const Psf* psf,
                const Sampling& sampling, const Instants& instants, std::span<const SweptBody> swept,
                Tracer& tracer, std::vector<std::int32_t>& candidates);

    /// Traces the pixels [16 block, 16 block + 16) of row `y`; false when no body is near. With a grid, whose
    /// rows about `y` are filled, pixels in smooth regions are filtered from it instead of having samples of
    /// their own. `estimates`: BlockResult::variance is wanted.
    bool trace(std::int32_t block, std::int32_t y, BlockResult& result, bool estimates = false,
               const SampleGridKernel* kernel = nullptr, const SampleGrid* grid = nullptr);

    /// Traces the grid's points of that block.
    void trace_grid(std::int32_t block, std::int32_t y, const SampleGridKernel& kernel, SampleGrid& grid);

    /// Traces 16 points of a row of a sparse grid, `step` apart from (x, y); their values to `out`, one plane
    /// of `plane` floats for each channel.
    void trace_points(double x, double y, double step, float* out, std::size_t plane);
    /// The bodies that may be seen in the block's pixels.
    [[nodiscard]] NearBodies near(std::int32_t block, std::int32_t y) {
        set_block(block, y);
        return find_near();
    }

    /// The block that holds column `x`.
    static std::int32_t block_of(std::int32_t x) {
        return x >= 0 ? x / packet_size : -((-x + packet_size - 1) / packet_size);
    }

private:
    struct Sums {
        double channel[max_channels][packet_size];
        double least[packet_size];
        double most[packet_size];
        std::uint32_t count[packet_size] = {};
        NoiseSums noise;    ///< of the means over the channels
        bool adds_to_noise; ///< false: not requested
    };

    /// Samples that are traced together.
    struct Batch;

    /// Sets the block, and the directions and solid angles of its pixels.
    void set_block(std::int32_t block, std::int32_t y);
    /// Sets the seeds of the block's pixels, which only samples need.
    void set_seeds();
    /// Finds the bodies that the block's pixels may show at some instant; lists them in `candidates_`.
    NearBodies find_near();
    /// Sets the places on a body that the samples of the block fall on at the row's instants, along a line.
    void set_places(std::size_t body);
    /// Turns directions by the aberration of each lane's instant.
    void aberrate_at(const Words& instant, Vec3s& direction) const;
    /// Number of samples that brings a pixel of standard deviation `spread` to the error `aim`.
    [[nodiscard]] std::uint32_t samples_for(double spread, double aim, std::uint32_t least) const;
    /// As samples_for(), for a pixel whose `count` samples have the error `error`, of indirect light.
    [[nodiscard]] std::uint32_t indirect_samples_for(double error, double count, double aim,
                                                     std::uint32_t least) const;
    /// Error aimed at, before any margin, in a pixel of value `mean` in a block of mean value `block_mean`.
    [[nodiscard]] double goal(const NearBodies& near, int pixel, double mean, double block_mean) const;
    /// Takes smooth pixels from the grid; sets `wanted` samples for the others.
    void take_smooth(const SampleGridKernel& kernel, const SampleGrid& grid, const NearBodies& near,
                     BlockResult& result, std::uint32_t (&wanted)[packet_size]) const;
    /// Sets `wanted` samples of pixels whose error exceeds the goal; false when there are none. `variance`:
    /// of the pixels that have samples.
    bool refine(const NearBodies& near, const BlockResult& result, bool first_round, const Sums& sums,
                const Doubles& variance, std::uint32_t (&wanted)[packet_size]) const;
    /// Sums the samples [count, wanted) of every pixel.
    void sample(const std::uint32_t (&wanted)[packet_size], Sums& sums);
    /// Distributes the samples of the batch over packets: of several instants, those that are near a body.
    void arrange(Batch& batch) const;
    /// Chooses the instants of the batch's samples. Fills `order` with those that are near a body then, by
    /// the place on the body that they fall on, so that rays of one packet are alike; returns their number.
    /// The others get no slot.
    int sort_by_instant(Batch& batch, Words (&instants)[Tracer::batch_size],
                        std::int32_t (&order)[Tracer::batch_size * packet_size]) const;
    /// Chooses the instants of 16 samples from `first`; `u`: their places in the exposure, in [0,1);
    /// `centre`: the directions of their pixels then.
    void choose_instants(const Batch& batch, int first, Doubles& u, Words& instant, Vec3s& centre) const;
    /// Sets `near` to those of 16 directions that are near a body at their instants, by the bodies' cones
    /// and, with `test_hulls`, hulls. Whether it is worth while to test the hulls of the next 16 as well.
    bool find_near_at(const Words& instant, const Vec3s& centre, bool test_hulls, Lanes& near) const;
    /// Seeds the rays of packet `k`; `x`, `y`: their points of the sensor.
    void aim(Batch& batch, std::size_t k, Doubles& x, Doubles& y) const;
    /// Traces the samples of the batch, adds them in order, and empties it.
    void trace(Batch& batch, Sums& sums);
    /// Intersects camera rays through the given points of the sensor.
    void intersect(const Doubles& x, const Doubles& y, const Lanes& active, CameraRays& rays,
                   Doubles& solid_angle);

    const Projection& projection_;
    const GaussianPsf& gaussian_psf_;
    const Psf* psf_; ///< if any, instead of the Gaussian
    const Sampling& sampling_;
    const Instants instants_;
    const RowState& row_; ///< the first of them
    std::span<const SweptBody> swept_;
    Tracer& tracer_;
    std::vector<std::int32_t>& candidates_;
    bool sunlight_only_; ///< of the tracer
    bool aberration_;    ///< at some instant
    std::int32_t first_x_ = 0, y_ = 0;
    Vec3s centre_; ///< directions of the pixels' centres
    Doubles solid_angle_;
    Words lens_seed_, light_seed_; ///< of set_seeds()
    /// Place on a body, from 0 to the number of parts: first_place_ plus these times the number of the pixel
    /// in the block and the place in the exposure, 0 to 1.
    double first_place_ = 0, place_of_pixel_ = 0, place_of_time_ = 0;
};

} // namespace obscura::renderer
