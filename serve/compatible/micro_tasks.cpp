// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/micro_tasks.hpp"

#include "service/failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <variant>

namespace obscura::serve::compatible {
namespace {

using service::compatible::List;
using service::compatible::Value;

constexpr std::size_t numbers_a_row = 9, column = 1, row_number = 2, weight = 7;
constexpr std::int32_t cluster_edge = 16;
/// Pixels between two of a row for which no window ends.
constexpr std::int32_t min_gap = 8;

/// NaN: no number.
double number_of(const Value& value) {
    return std::visit(
        [](const auto& held) {
            if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(held)>>)
                return static_cast<double>(held);
            else
                return std::nan("");
        },
        value.data);
}

} // namespace

List micro_tasks(std::int32_t width, std::int32_t height, std::uint32_t samples, double exposure_s) {
    List tasks;
    tasks.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    const std::int32_t across = (width + cluster_edge - 1) / cluster_edge;
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x) {
            const std::int32_t cluster = y / cluster_edge * across + x / cluster_edge;
            List row;
            row.reserve(numbers_a_row);
            for (const double number :
                 {static_cast<double>(cluster), static_cast<double>(x), static_cast<double>(y),
                  static_cast<double>(samples), -1.0, 0.0, exposure_s, 1.0, 0.0})
                row.emplace_back(number);
            tasks.emplace_back(std::move(row));
        }
    return tasks;
}

std::vector<float> weights_of(const Value& tasks, std::int32_t width, std::int32_t height) {
    const List* rows = tasks.as<List>();
    if (rows == nullptr)
        throw service::bad_argument("utasks", "utasks: no list, allowed a list of rows of 9 numbers");
    std::vector<float> weights(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (std::size_t i = 0; i < rows->size(); ++i) {
        const List* row = (*rows)[i].as<List>();
        const auto mistake = [i](const std::string& what) {
            return service::bad_argument("utasks", fmt::format("utasks[{}]: {}", i, what));
        };
        if (row == nullptr || row->size() != numbers_a_row) throw mistake("no row, allowed 9 numbers");
        const double x = number_of((*row)[column]), y = number_of((*row)[row_number]),
                     w = number_of((*row)[weight]);
        if (!(x >= 0 && x < width && y >= 0 && y < height))
            throw mistake(
                fmt::format("pixel {}, {} is outside, allowed 0, 0 to {}, {}", x, y, width - 1, height - 1));
        if (!(w >= 0 && w <= 1)) throw mistake(fmt::format("weight {}, allowed 0 to 1", w));
        float& sum = weights[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                             static_cast<std::size_t>(x)];
        sum = std::min(1.0F, sum + static_cast<float>(w));
    }
    return weights;
}

std::vector<Region> windows_of(const std::vector<float>& weights, std::int32_t width) {
    std::vector<Region> done, open; // open ones reach down to the row above
    const auto height = static_cast<std::int32_t>(weights.size() / static_cast<std::size_t>(width));
    for (std::int32_t y = 0; y < height; ++y) {
        const float* const row =
            weights.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
        std::vector<Region> runs;
        for (std::int32_t x = 0; x < width; ++x) {
            if (row[x] <= 0) continue;
            if (runs.empty() || x - (runs.back().x + runs.back().width) >= min_gap)
                runs.push_back({x, y, 1, 1});
            else
                runs.back().width = x - runs.back().x + 1;
        }
        const auto same_columns = [](const Region& a, const Region& b) {
            return a.x == b.x && a.width == b.width;
        };
        if (std::equal(runs.begin(), runs.end(), open.begin(), open.end(), same_columns)) {
            for (Region& window : open)
                ++window.height;
            continue;
        }
        done.insert(done.end(), open.begin(), open.end());
        open = std::move(runs);
    }
    done.insert(done.end(), open.begin(), open.end());
    return done;
}

} // namespace obscura::serve::compatible
