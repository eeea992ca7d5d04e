// SPDX-License-Identifier: Apache-2.0
// Rasters in memory as sources of giant textures.
#pragma once

#include "terrain/obt/obt_writer.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>

namespace obscura::test {

/// Numbers by a function of plane, column and row.
class FunctionSource final : public terrain::ObtSource {
public:
    using Function = std::function<float(std::uint32_t, std::int64_t, std::int64_t)>;
    explicit FunctionSource(Function function, bool rows = false)
        : function_(std::move(function)), rows_(rows) {}
    void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override {
        ++calls;
        if (fail_at > 0 && calls >= fail_at) throw std::runtime_error("the source failed");
        if (rows_ && y < next_row_[plane]) throw std::runtime_error("rows asked for twice");
        if (rows_) next_row_[plane] = y + rows;
        for (int j = 0; j < rows; ++j)
            for (int i = 0; i < columns; ++i)
                out[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) +
                    static_cast<std::size_t>(i)] = function_(plane, x + i, y + j);
    }
    [[nodiscard]] bool by_rows() const override { return rows_; }

    int calls = 0, fail_at = 0;

private:
    Function function_;
    bool rows_;
    std::int64_t next_row_[terrain::max_obt_planes]{};
};

/// A hash of a place, 0 to below 1.
inline float noise_at(std::uint32_t plane, std::int64_t x, std::int64_t y) {
    std::uint64_t h = (static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15U) ^
                      (static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4FU) ^ (plane * 0x165667B19E3779F9U);
    h = (h ^ h >> 31) * 0xBF58476D1CE4E5B9U;
    h = (h ^ h >> 29) * 0x94D049BB133111EBU;
    return static_cast<float>(h >> 40) * 0x1p-24F;
}

inline terrain::ObtMetadata planar_metadata(terrain::SampleType type, std::int64_t width, std::int64_t height,
                                            std::uint32_t planes = 1) {
    terrain::ObtMetadata m;
    m.kind = planes > 1 ? terrain::ObtKind::parameter : terrain::ObtKind::heights;
    m.type = type;
    m.width = width;
    m.height = height;
    m.planes = planes;
    m.projection.kind = terrain::ProjectionKind::planar;
    return m;
}

inline std::string bytes_of_file(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

} // namespace obscura::test
