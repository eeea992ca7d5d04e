// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/polar_cap.hpp"

#include "terrain/detail/exact_math.hpp"
#include "terrain/maps/cubic.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::terrain {
namespace {

/// The absolute weights of a cubic along an axis have sums of up to 1.25.
constexpr double cubic_overshoot = (1.25 * 1.25 - 1) / 2;

} // namespace

PolarCap::PolarCap(double rows, const std::function<double(double distance, double turn)>& value)
    : rows_(rows) {
    exists_ = true;
    for (int j = -reach; j <= reach; ++j)
        for (int i = -reach; i <= reach; ++i) {
            const double node = value(std::sqrt(static_cast<double>(i * i + j * j)), exact_turn(i, j));
            nodes_[static_cast<std::size_t>(j + reach) * edge + static_cast<std::size_t>(i + reach)] = node;
            exists_ = exists_ && !std::isnan(node);
        }
    if (!exists_) return;
    const auto [least, largest] = std::minmax_element(nodes_.begin(), nodes_.end());
    const double over =
        cubic_overshoot * (*largest - *least) + 1e-6 * std::max(std::abs(*least), std::abs(*largest));
    range_ = {static_cast<float>(*least - over), static_cast<float>(*largest + over)};
}

double PolarCap::at(double distance, double turn) const {
    const CosineSine direction = exact_cosine_sine(turn);
    const double x = distance * direction.cosine, y = distance * direction.sine;
    const auto first = [](double place) { return std::clamp(std::floor(place), -max_reach, max_reach - 1); };
    const double left = first(x), top = first(y);
    const std::array<double, 4> across = catmull_rom(x - left), down = catmull_rom(y - top);
    const double* node = nodes_.data() + static_cast<std::size_t>(top - 1 + reach) * edge +
                         static_cast<std::size_t>(left - 1 + reach);
    double sum = 0;
    for (const double weight : down) {
        sum +=
            weight * (across[0] * node[0] + across[1] * node[1] + across[2] * node[2] + across[3] * node[3]);
        node += edge;
    }
    return sum;
}

double PolarCap::share(double distance) const {
    return smooth_step(1.5 * (1 - distance / rows_));
}

} // namespace obscura::terrain
