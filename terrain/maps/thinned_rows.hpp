// SPDX-License-Identifier: Apache-2.0
// Rows of a raster with fewer and wider columns, as reduced grids of the sphere have them towards the poles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace obscura::terrain {

/// Columns of a row, and how wider ones are made of them: the mean of the samples below each that have data,
/// weighted by what it covers of them, from which sharpen() takes what the mean of a parabola exceeds its
/// middle by. A value; thread-safe.
class ThinnedRows {
public:
    ThinnedRows() = default;
    /// A row of `columns` samples of which the last covers the share `last` of a column. `cyclic`: the first
    /// follows on the last. `nodes`: samples are at places, and cover what is nearest to them.
    ThinnedRows(std::int64_t columns, double last, bool cyclic, bool nodes);

    /// Number of times that columns can be halved.
    [[nodiscard]] int most() const { return static_cast<int>(counts_.size()) - 1; }
    /// Columns after halving `times`; even on cyclic rows, so that opposite ones exist.
    [[nodiscard]] std::int64_t count(int times) const { return counts_[static_cast<std::size_t>(times)]; }
    /// Place among `count` columns of the place `x` among the samples.
    [[nodiscard]] double place(double x, std::int64_t count) const {
        return (x + middle_) * (static_cast<double>(count) / width_) - 0.5;
    }
    /// Part of a full turn at the place `x` among the samples.
    [[nodiscard]] double turn(double x) const { return (x + middle_) / width_; }

    /// Samples that columns `first` to `first + wanted - 1` out of `count` are made of: all inside the row.
    struct Span {
        std::int64_t first = 0, count = 0;
    };
    [[nodiscard]] Span source(std::int64_t count, std::int64_t first, std::int64_t wanted) const;
    /// Makes these columns from `samples`, those of source().
    void thin(std::int64_t count, std::int64_t first, std::span<const float> samples,
              std::span<float> out) const;

    /// out[k] from means[k] to means[k + 2], of which means[k + 1] has its place.
    void sharpen(std::int64_t count, std::span<const float> means, std::span<float> out) const;
    /// Largest sum of the absolute weights of means in plain cubics of sharpened ones.
    static constexpr double max_weight = 1.3647;

private:
    /// Where sample `j` begins, in samples from the beginning of the row.
    [[nodiscard]] double begin_of(std::int64_t j) const {
        return j <= 0 ? 0 : j >= columns_ ? width_ : static_cast<double>(j) - before_;
    }
    [[nodiscard]] std::int64_t sample_at(double place) const;

    std::int64_t columns_ = 1;
    double width_ = 1;   ///< of the row, in samples
    double middle_ = .5; ///< of the first sample's place from the beginning of the row
    double before_ = 0;
    std::vector<std::int64_t> counts_{1};
};

} // namespace obscura::terrain
