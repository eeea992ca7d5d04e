// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/psf_core.hpp"

#include <algorithm>
#include <utility>

namespace obscura::renderer {

PsfCore::PsfCore(std::int32_t half, const std::vector<std::vector<double>>& psf)
    : side_(2 * half + 1 + per_pixel), reach_px_((side_ - 1) / 2.0 / per_pixel) {
    for (const std::vector<double>& grid : psf)
        add_band(half, grid);
    const bool same = std::all_of(psf.begin(), psf.end(),
                                  [&](const std::vector<double>& grid) { return grid == psf.front(); });
    if (same) response_.resize(1);
    set_sums();
}

std::vector<float> PsfCore::integrated(std::int32_t half, const std::vector<double>& grid) const {
    const std::int32_t from_side = 2 * half + 1;
    const auto side = static_cast<std::size_t>(side_);
    const double step = 1.0 / per_pixel;
    // Integrate over the pixel's square, one axis after the other, by the trapezoidal rule: squares of whole
    // steps tile.
    std::vector<double> across(static_cast<std::size_t>(from_side) * side, 0.0);
    std::vector<float> out(side * side);
    for (std::int32_t j = 0; j < from_side; ++j)
        for (std::int32_t i = 0; i < side_; ++i)
            for (std::int32_t k = 0; k <= per_pixel; ++k) {
                const std::int32_t at = i - k;
                if (at < 0 || at >= from_side) continue;
                const double weight = (k == 0 || k == per_pixel ? 0.5 : 1.0) * step;
                across[static_cast<std::size_t>(j) * side + static_cast<std::size_t>(i)] +=
                    weight * grid[static_cast<std::size_t>(j) * static_cast<std::size_t>(from_side) +
                                  static_cast<std::size_t>(at)];
            }
    for (std::int32_t j = 0; j < side_; ++j)
        for (std::int32_t i = 0; i < side_; ++i) {
            double sum = 0;
            for (std::int32_t k = 0; k <= per_pixel; ++k) {
                const std::int32_t at = j - k;
                if (at < 0 || at >= from_side) continue;
                const double weight = (k == 0 || k == per_pixel ? 0.5 : 1.0) * step;
                sum += weight * across[static_cast<std::size_t>(at) * side + static_cast<std::size_t>(i)];
            }
            out[static_cast<std::size_t>(j) * side + static_cast<std::size_t>(i)] = static_cast<float>(sum);
        }
    return out;
}

void PsfCore::add_band(std::int32_t half, const std::vector<double>& grid) {
    const std::int32_t from_side = 2 * half + 1;
    const double step = 1.0 / per_pixel;
    response_.push_back(integrated(half, grid));
    double sum = 0;
    ImagePoint moment;
    for (std::int32_t j = 0; j < from_side; ++j)
        for (std::int32_t i = 0; i < from_side; ++i) {
            const double d = grid[static_cast<std::size_t>(j) * static_cast<std::size_t>(from_side) +
                                  static_cast<std::size_t>(i)];
            sum += d;
            moment.x += d * (i - half) * step, moment.y += d * (j - half) * step;
        }
    light_.push_back(sum * step * step);
    centroid_.push_back(sum > 0 ? ImagePoint{moment.x / sum, moment.y / sum} : ImagePoint{});
}

double PsfCore::cell_mean(const std::vector<float>& response, std::size_t i, std::size_t j) const {
    const auto side = static_cast<std::size_t>(side_);
    const float* at = response.data() + j * side + i;
    return (static_cast<double>(at[0]) + static_cast<double>(at[1]) + static_cast<double>(at[side]) +
            static_cast<double>(at[side + 1])) /
           4;
}

void PsfCore::set_sums() {
    const auto side = static_cast<std::size_t>(side_);
    const double step = 1.0 / per_pixel;
    const std::size_t cells = (side - 1) * (side - 1);
    column_sums_.resize(cells);
    std::vector<double> total(cells, 0.0);
    double all = 0;
    for (std::size_t j = 0; j + 1 < side; ++j) {
        double row = 0;
        for (std::size_t i = 0; i + 1 < side; ++i) {
            double& t = total[j * (side - 1) + i];
            for (const std::vector<float>& r : response_)
                t += cell_mean(r, i, j);
            row += t;
        }
        double sum = 0;
        for (std::size_t i = 0; i + 1 < side; ++i) {
            sum += total[j * (side - 1) + i];
            column_sums_[j * (side - 1) + i] = row > 0 ? static_cast<float>(sum / row) : 1.0F;
        }
        all += row;
        row_sums_.push_back(all);
    }
    for (double& s : row_sums_)
        s /= all;
    if (response_.size() == 1) return; // of all bands
    for (const std::vector<float>& r : response_) {
        std::vector<float> ratio(cells, 0.0F);
        for (std::size_t j = 0; j + 1 < side; ++j)
            for (std::size_t i = 0; i + 1 < side; ++i) {
                const double t = total[j * (side - 1) + i];
                if (t > 0)
                    ratio[j * (side - 1) + i] =
                        static_cast<float>(cell_mean(r, i, j) * step * step * all / t);
            }
        ratio_.push_back(std::move(ratio));
    }
}

void PsfCore::sample(double u, double v, double& x, double& y, std::size_t& cell) const {
    const auto cells = static_cast<std::size_t>(side_ - 1);
    const auto row = static_cast<std::size_t>(
        std::min(std::upper_bound(row_sums_.begin(), row_sums_.end(), u) - row_sums_.begin(),
                 static_cast<std::ptrdiff_t>(cells) - 1));
    const double below = row > 0 ? row_sums_[row - 1] : 0;
    const auto first = column_sums_.begin() + static_cast<std::ptrdiff_t>(row * cells);
    const auto last = first + static_cast<std::ptrdiff_t>(cells);
    const auto column =
        static_cast<std::size_t>(std::min(std::upper_bound(first, last, static_cast<float>(v)) - first,
                                          static_cast<std::ptrdiff_t>(cells) - 1));
    const double left = column > 0 ? static_cast<double>(first[static_cast<std::ptrdiff_t>(column) - 1]) : 0;
    const double height = row_sums_[row] - below;
    const double width = static_cast<double>(first[static_cast<std::ptrdiff_t>(column)]) - left;
    const double in_row = height > 0 ? std::clamp((u - below) / height, 0.0, 1.0) : 0.5;
    const double in_column = width > 0 ? std::clamp((v - left) / width, 0.0, 1.0) : 0.5;
    y = (static_cast<double>(row) + in_row) / per_pixel - reach_px_;
    x = (static_cast<double>(column) + in_column) / per_pixel - reach_px_;
    cell = row * cells + column;
}

double PsfCore::response(std::size_t band, double x, double y) const {
    const double column = (x + reach_px_) * per_pixel;
    const double row = (y + reach_px_) * per_pixel;
    if (!(column >= 0 && row >= 0 && column < side_ - 1 && row < side_ - 1)) return 0;
    const auto i = static_cast<std::size_t>(column);
    const auto j = static_cast<std::size_t>(row);
    const auto side = static_cast<std::size_t>(side_);
    const float* at = response_[response_.size() > 1 ? band : 0].data() + j * side + i;
    const double a = column - static_cast<double>(i);
    const double b = row - static_cast<double>(j);
    const double top = static_cast<double>(at[0]) * (1 - a) + static_cast<double>(at[1]) * a;
    const double bottom = static_cast<double>(at[side]) * (1 - a) + static_cast<double>(at[side + 1]) * a;
    return top * (1 - b) + bottom * b;
}

} // namespace obscura::renderer
