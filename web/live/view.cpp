// SPDX-License-Identifier: Apache-2.0
#include "web/live/view.hpp"

#include <algorithm>

namespace obscura::web {
namespace {

/// Reduces the columns of bins whose rows have been reduced to `line`.
template<typename Join>
void reduce_line(const std::vector<std::uint32_t>& line, const View& view, std::size_t rows, Join join,
                 std::vector<std::uint16_t>& out) {
    for (std::size_t x = 0; x < line.size(); x += view.bin) {
        const std::size_t columns = std::min<std::size_t>(view.bin, line.size() - x);
        std::uint32_t value = line[x];
        for (std::size_t i = 1; i < columns; ++i)
            value = join(value, line[x + i]);
        if (view.reduce == Reduce::mean) {
            const auto count = static_cast<std::uint32_t>(columns * rows);
            value = (value + count / 2) / count;
        }
        out.push_back(static_cast<std::uint16_t>(value));
    }
}

/// `join` of two numbers; sums of 64 x 64 pixels fit.
template<typename Join>
std::vector<std::uint16_t> reduced_by(std::span<const std::uint16_t> image, std::uint32_t image_width,
                                      const View& view, Join join) {
    std::vector<std::uint16_t> out;
    out.reserve(view.columns() * view.rows());
    std::vector<std::uint32_t> line(view.width);
    for (std::size_t y = 0; y < view.height; y += view.bin) {
        const std::size_t rows = std::min<std::size_t>(view.bin, view.height - y);
        const std::uint16_t* row = image.data() + (view.y + y) * image_width + view.x;
        std::copy_n(row, line.size(), line.begin());
        for (std::size_t i = 1; i < rows; ++i) {
            row += image_width;
            for (std::size_t x = 0; x < line.size(); ++x)
                line[x] = join(line[x], row[x]);
        }
        reduce_line(line, view, rows, join, out);
    }
    return out;
}

} // namespace

View clipped(const View& view, std::uint32_t image_width, std::uint32_t image_height) {
    const auto part = [](std::uint32_t& at, std::uint32_t& size, std::uint32_t image) {
        at = std::min(at, image - 1);
        size = size == 0 ? image - at : std::min(size, image - at);
    };
    View out = view;
    part(out.x, out.width, image_width);
    part(out.y, out.height, image_height);
    return out;
}

std::vector<std::uint16_t> reduced(std::span<const std::uint16_t> image, std::uint32_t image_width,
                                   const View& view) {
    if (view.bin == 1) {
        std::vector<std::uint16_t> out;
        out.reserve(view.columns() * view.rows());
        for (std::size_t y = view.y; y < view.y + view.height; ++y) {
            const auto row = image.begin() + static_cast<std::ptrdiff_t>(y * image_width + view.x);
            out.insert(out.end(), row, row + static_cast<std::ptrdiff_t>(view.width));
        }
        return out;
    }
    using Number = std::uint32_t;
    if (view.reduce == Reduce::max)
        return reduced_by(image, image_width, view, [](Number a, Number b) { return std::max(a, b); });
    return reduced_by(image, image_width, view, [](Number a, Number b) { return a + b; });
}

Histogram histogram_of(std::span<const std::uint16_t> image, unsigned bits,
                       std::vector<std::uint32_t>& counts) {
    counts.assign(65536, 0); // every number that a pixel can hold has a place
    for (const std::uint16_t dn : image)
        ++counts[dn];
    Histogram out;
    const std::size_t full = (std::size_t{1} << bits) - 1;
    const std::uint64_t half = (image.size() + 1) / 2, most = (99 * image.size() + 99) / 100;
    std::uint64_t below = 0;
    double sum = 0;
    bool found = false;
    for (std::size_t dn = 0; dn < counts.size(); ++dn) {
        const std::uint64_t count = counts[dn];
        if (count == 0) continue;
        const auto number = static_cast<std::uint16_t>(dn);
        if (!found) out.min = number;
        found = true;
        out.max = number;
        out.bins[std::min<std::size_t>(dn >> (bits - 8), out.bins.size() - 1)] += count;
        if (dn >= full) out.saturated += count;
        sum += static_cast<double>(count) * static_cast<double>(dn);
        if (below < half && below + count >= half) out.p50 = number;
        if (below < most && below + count >= most) out.p99 = number;
        below += count;
    }
    out.mean = sum / static_cast<double>(image.size());
    return out;
}

} // namespace obscura::web
