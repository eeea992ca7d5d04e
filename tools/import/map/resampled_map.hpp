// SPDX-License-Identifier: Apache-2.0
// Map in a projection that terrain::Projection does not have, resampled to one that it has.
#pragma once

#include "tools/import/map/map_source.hpp"

namespace obscura::tools {

/// Simple cylindrical, or polar stereographic if the map is about one pole; samples as fine as those of the
/// file in its middle. PROJ says where each sample of the result lies in the file; there, Catmull-Rom
/// interpolation of 4 x 4 samples (bilinear of those present beside missing ones). Maps of a whole turn whose
/// columns are meridians go on across their edges.
class ResampledMap final : public RasterReader {
public:
    /// Throws InputError if the file's projection is not usable.
    ResampledMap(MapSource& source, const MapSettings& settings, MapRemarks& remarks);

    [[nodiscard]] const terrain::MapFrame& frame() const { return frame_; }

    [[nodiscard]] std::uint32_t planes() const override { return source_.planes(); }
    [[nodiscard]] std::int64_t width() const override { return frame_.width(); }
    [[nodiscard]] std::int64_t height() const override { return frame_.height(); }
    [[nodiscard]] bool by_rows() const override { return false; }
    void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override;

private:
    struct Block {
        std::int64_t x, y;
        int columns, rows;
    };
    /// Places in the file of the samples of a block; NaN: there is none.
    [[nodiscard]] std::vector<terrain::SamplePlace> places(const Block& block) const;
    [[nodiscard]] std::vector<terrain::SamplePlace>
    places_of(std::vector<std::array<double, 2>> degrees) const;
    [[nodiscard]] std::vector<std::array<double, 2>> sampled_places() const;
    [[nodiscard]] std::array<double, 2> degrees_at(double x, double y) const;
    void resample(std::uint32_t plane, const Block& block, float* out, std::size_t stride);
    void find_period();

    MapSource& source_;
    terrain::MapFrame frame_;
    double period_ = 0; ///< columns of the file's full turn, if it has one
};

} // namespace obscura::tools
