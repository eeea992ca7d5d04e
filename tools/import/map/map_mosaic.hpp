// SPDX-License-Identifier: Apache-2.0
// Several maps on one grid as one raster.
#pragma once

#include "tools/import/map/map_source.hpp"

#include <memory>
#include <vector>

namespace obscura::tools {

/// Rectangle around all maps. Where they overlap the first with a number is taken; where there is none,
/// numbers are missing.
class MapMosaic final : public RasterReader {
public:
    /// Throws InputError if a map is not on the grid of the first, or of other numbers.
    explicit MapMosaic(std::vector<std::unique_ptr<MapSource>> maps);

    /// Frame of the whole, with the projection of the first map.
    [[nodiscard]] const terrain::MapFrame& frame() const { return frame_; }
    /// Whether maps leave part of the rectangle open.
    [[nodiscard]] bool has_gaps() const { return has_gaps_; }
    [[nodiscard]] const std::vector<std::unique_ptr<MapSource>>& maps() const { return maps_; }

    [[nodiscard]] std::uint32_t planes() const override { return maps_.front()->planes(); }
    [[nodiscard]] std::int64_t width() const override { return frame_.width(); }
    [[nodiscard]] std::int64_t height() const override { return frame_.height(); }
    [[nodiscard]] bool by_rows() const override;
    void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override;

private:
    struct Part {
        std::int64_t x = 0, y = 0; ///< of its first sample in the whole
    };
    std::vector<std::unique_ptr<MapSource>> maps_;
    std::vector<Part> parts_;
    terrain::MapFrame frame_;
    bool has_gaps_ = false;
};

} // namespace obscura::tools
