// SPDX-License-Identifier: Apache-2.0
#include "terrain/obt/obt_reduction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace obscura::terrain::obt {
namespace {

constexpr float reduced_no_data = std::numeric_limits<float>::quiet_NaN();

/// Finest samples that sample `index` of a level stands for.
double cover(std::int64_t index, int level, std::int64_t size) {
    const std::int64_t first = index << level;
    return static_cast<double>(std::min(size, first + (std::int64_t{1} << level)) - first);
}

/// Up to three samples of the finer level and their weights along one axis, and the same as two.
struct Taps {
    std::int64_t first = 0;
    int count = 0;
    double weight[3]{};
};

Taps taps_of(std::int64_t index, const SampleBlock& fine, Registration registration, std::int64_t size,
             std::int64_t begin, std::int64_t end) {
    Taps t;
    if (registration == Registration::pixel) {
        t.first = 2 * index;
        for (; t.count < 2 && t.first + t.count < end; ++t.count)
            t.weight[t.count] = cover(t.first + t.count, fine.level, size);
    } else {
        t.first = std::max(2 * index - 1, begin);
        for (std::int64_t i = t.first; i <= 2 * index + 1 && i < end; ++i)
            t.weight[t.count++] = i == 2 * index ? 2 : 1;
    }
    return t;
}

/// Two neighbours and the place between them.
struct Between {
    std::int64_t first = 0, second = 0;
    double share = 0;
};

Between between(std::int64_t index, Registration registration, std::int64_t begin, std::int64_t end) {
    Between b;
    const std::int64_t half = index / 2;
    if (registration == Registration::node) {
        b = {half, half + index % 2, 0.5 * static_cast<double>(index % 2)};
    } else if (index % 2 == 0) {
        b = {half - 1, half, 0.75};
    } else {
        b = {half, half + 1, 0.25};
    }
    b.first = std::clamp(b.first, begin, end - 1);
    b.second = std::clamp(b.second, begin, end - 1);
    return b;
}

} // namespace

void reduce(const SampleBlock& fine, Registration registration, std::int64_t width, std::int64_t height,
            SampleBlock& coarse) {
    coarse.level = fine.level + 1;
    coarse.x = fine.x / 2;
    coarse.y = fine.y / 2;
    coarse.columns = (fine.columns + 1) / 2;
    coarse.rows = (fine.rows + 1) / 2;
    const auto columns = static_cast<std::size_t>(coarse.columns);
    coarse.samples.resize(columns * static_cast<std::size_t>(coarse.rows));
    const std::int64_t right = fine.x + fine.columns, bottom = fine.y + fine.rows;
    std::vector<Taps> across(columns);
    // Weights add up to 1 where nothing is missing: products with powers of two are exact.
    const auto normalise = [](Taps& t) {
        const double sum = t.weight[0] + t.weight[1] + t.weight[2];
        for (double& w : t.weight)
            w /= sum;
    };
    for (std::size_t i = 0; i < columns; ++i) {
        across[i] =
            taps_of(coarse.x + static_cast<std::int64_t>(i), fine, registration, width, fine.x, right);
        normalise(across[i]);
    }
    const bool pairs = registration == Registration::pixel;
    for (int j = 0; j < coarse.rows; ++j) {
        Taps down = taps_of(coarse.y + j, fine, registration, height, fine.y, bottom);
        normalise(down);
        const float* lines[3]{};
        for (int k = 0; k < down.count; ++k)
            lines[k] = fine.samples.data() + static_cast<std::size_t>(down.first + k - fine.y) *
                                                 static_cast<std::size_t>(fine.columns);
        float* const out = coarse.samples.data() + static_cast<std::size_t>(j) * columns;
        for (std::size_t i = 0; i < columns; ++i) {
            const Taps& t = across[i];
            const std::int64_t x = t.first - fine.x;
            double sum = 0;
            if (pairs && t.count == 2 && down.count == 2) {
                const float* const a = lines[0] + x;
                const float* const b = lines[1] + x;
                sum = down.weight[0] * (t.weight[0] * static_cast<double>(a[0]) +
                                        t.weight[1] * static_cast<double>(a[1])) +
                      down.weight[1] *
                          (t.weight[0] * static_cast<double>(b[0]) + t.weight[1] * static_cast<double>(b[1]));
                if (!std::isnan(sum)) {
                    out[i] = static_cast<float>(sum);
                    continue;
                }
            }
            double weights = 0;
            sum = 0;
            for (int k = 0; k < down.count; ++k)
                for (int l = 0; l < t.count; ++l) {
                    const auto v = static_cast<double>(lines[k][x + l]);
                    if (std::isnan(v)) continue;
                    sum += down.weight[k] * t.weight[l] * v;
                    weights += down.weight[k] * t.weight[l];
                }
            out[i] = weights > 0 ? static_cast<float>(sum / weights) : reduced_no_data;
        }
    }
}

double largest_difference(const SampleBlock& fine, const SampleBlock& coarse, Registration registration,
                          std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1) {
    if (x1 <= x0) return 0;
    const std::int64_t right = coarse.x + coarse.columns, bottom = coarse.y + coarse.rows;
    const auto pairs = static_cast<std::size_t>((x1 - x0 + 1) / 2);
    // Columns of the coarse level from the one before x0 / 2 on, of which each serves two of the fine one;
    // beyond the edges the nearest.
    std::vector<double> mixed(pairs + 2);
    const std::int64_t before = x0 / 2 - 1;
    const std::int64_t begin = std::max(before, coarse.x);
    const std::int64_t end = std::min(before + static_cast<std::int64_t>(mixed.size()), right);
    // Even and odd columns of the fine level lie between these, at these shares of the second one.
    const bool pixels = registration == Registration::pixel;
    const double even = pixels ? 0.75 : 0, odd = pixels ? 0.25 : 0.5;
    // Several at a time.
    constexpr std::size_t lanes = 8;
    std::vector<double> differences((2 * pairs + lanes - 1) / lanes * lanes);
    std::vector<float> exact(2 * pairs);
    std::array<double, lanes> largest{};
    for (std::int64_t y = y0; y < y1; ++y) {
        const Between down = between(y, registration, coarse.y, bottom);
        const auto line = [&](std::int64_t row) {
            return coarse.samples.data() +
                   static_cast<std::size_t>(row - coarse.y) * static_cast<std::size_t>(coarse.columns) +
                   (begin - coarse.x);
        };
        const float* const upper = line(down.first);
        const float* const lower = line(down.second);
        double* const inside = mixed.data() + (begin - before);
        const double share = down.share;
        for (std::size_t c = 0; c < static_cast<std::size_t>(end - begin); ++c)
            inside[c] = static_cast<double>(upper[c]) * (1 - share) + static_cast<double>(lower[c]) * share;
        std::fill(mixed.data(), inside, *inside);
        std::fill(inside + (end - begin), mixed.data() + mixed.size(), inside[end - begin - 1]);
        std::copy_n(fine.samples.data() +
                        static_cast<std::size_t>(y - fine.y) * static_cast<std::size_t>(fine.columns) +
                        static_cast<std::size_t>(x0 - fine.x),
                    x1 - x0, exact.data());
        if ((x1 - x0) % 2 != 0) exact.back() = reduced_no_data;
        const double* const left = mixed.data() + (pixels ? 0 : 1);
        const double* const middle = mixed.data() + 1;
        const double* const next = mixed.data() + 2;
        for (std::size_t c = 0; c < pairs; ++c) {
            differences[2 * c] =
                std::abs(left[c] * (1 - even) + middle[c] * even - static_cast<double>(exact[2 * c]));
            differences[2 * c + 1] =
                std::abs(middle[c] * (1 - odd) + next[c] * odd - static_cast<double>(exact[2 * c + 1]));
        }
        for (std::size_t i = 0; i < differences.size(); i += lanes)
            for (std::size_t lane = 0; lane < lanes; ++lane) // not for missing samples
                largest[lane] = differences[i + lane] > largest[lane] ? differences[i + lane] : largest[lane];
    }
    return *std::max_element(largest.begin(), largest.end());
}

} // namespace obscura::terrain::obt
