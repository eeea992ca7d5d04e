// SPDX-License-Identifier: Apache-2.0
// Raster of numbers that is read block by block, in a chain from map file to giant texture.
#pragma once

#include <cstdint>
#include <span>

namespace obscura::tools {

/// Thread-bound.
class RasterReader {
public:
    virtual ~RasterReader() = default;

    [[nodiscard]] virtual std::uint32_t planes() const = 0;
    [[nodiscard]] virtual std::int64_t width() const = 0;
    [[nodiscard]] virtual std::int64_t height() const = 0;
    /// Whether whole rows, in order, are read much faster than blocks.
    [[nodiscard]] virtual bool by_rows() const = 0;
    /// Numbers of columns x to x + columns - 1 and rows y to y + rows - 1, all inside the raster, into `out`
    /// (row-major); missing ones are NaN. Throws InputError.
    virtual void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
                      std::span<float> out) = 0;
};

} // namespace obscura::tools
