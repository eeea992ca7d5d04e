// SPDX-License-Identifier: Apache-2.0
// One map file as it is imported: place, numbers, their meaning.
#pragma once

#include "images/readers/pds3_layout.hpp"
#include "images/readers/pds_label.hpp"
#include "tools/gdal/process.hpp"
#include "tools/import/map/georeference.hpp"
#include "tools/import/map/raster_reader.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {

/// What the numbers of a file are.
struct MapNumbers : images::PdsNumbers {
    GdalType type{};
    bool masked = false; ///< a mask of the file says which are valid, too
};

/// Thread-bound, as its process is.
class MapSource final : public RasterReader {
public:
    /// Throws InputError.
    MapSource(GdalProcess& process, const std::filesystem::path& file, const MapSettings& settings,
              MapRemarks& remarks);

    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] const GdalMap& map() const { return map_; }
    [[nodiscard]] const Georeference& place() const { return place_; }
    [[nodiscard]] const MapNumbers& numbers() const { return numbers_; }
    /// Whether any sample may be missing.
    [[nodiscard]] bool may_have_holes() const;
    [[nodiscard]] bool rgb() const { return rgb_; }
    [[nodiscard]] GdalProcess& process() const { return process_; }

    /// Subtracted from each number before it becomes a float.
    void set_shift(double shift) { shift_ = shift; }

    [[nodiscard]] std::uint32_t planes() const override { return static_cast<std::uint32_t>(bands_.size()); }
    [[nodiscard]] std::int64_t width() const override { return map_.width; }
    [[nodiscard]] std::int64_t height() const override { return map_.height; }
    [[nodiscard]] bool by_rows() const override;
    void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override;

private:
    void open(const std::filesystem::path& file);
    void open_samples(const images::Pds3Layout& layout);
    void read_samples(std::int64_t band, std::int64_t x, std::int64_t y, int columns, int rows,
                      std::span<float> out);
    void choose_bands(const MapSettings& settings, MapRemarks& remarks);
    void read_numbers(const MapSettings& settings);
    void numbers_of_isis();
    void take_part();
    void check_projection(MapRemarks& remarks);

    GdalProcess& process_;
    std::string name_;
    GdalMap map_;
    std::optional<images::PdsLabel> label_;
    /// Samples of a PDS3 label that are not compressed; none: GDAL reads them.
    std::unique_ptr<images::Pds3Samples> samples_;
    Georeference place_;
    MapNumbers numbers_;
    std::vector<std::uint32_t> bands_; ///< of the planes, from 1
    bool rgb_ = false;
    double shift_ = 0;
    std::int64_t first_row_ = 0; ///< of the file
};

} // namespace obscura::tools
