// SPDX-License-Identifier: Apache-2.0
// Import of maps into a giant texture (.obt).
#pragma once

#include "terrain/obt/obt_writer.hpp"
#include "tools/gdal/process.hpp"
#include "tools/import/map/map_settings.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace obscura::tools {

struct MapImportTask {
    std::vector<std::string> files;
    std::filesystem::path output;
    MapSettings settings;
    bool fill = false;
    /// Texture of 1 where a sample was missing, else 0; empty: none.
    std::filesystem::path mask;
    bool restart = false; ///< what an interrupted import left is not used
    std::string title, licence;
    GdalLimits limits;
};

struct MapImportReport {
    terrain::ObtWriteReport written;
    MapRemarks remarks;
    std::string type;               ///< of the samples in the files
    std::uint64_t source_bytes = 0; ///< of the samples in the files
    std::uint64_t missing = 0;      ///< samples, if `missing_known`
    bool missing_known = false;
    std::uint64_t filled = 0;
    double min_number = 0, largest_number = 0; ///< as read, in the files' numbers
    double seconds = 0;
};

/// `progress` gets a step's name and what is done of it, and returns whether to go on. Throws InputError,
/// OutputError, and Error if the helper is missing.
[[nodiscard]] MapImportReport import_map(
    const MapImportTask& task,
    const std::function<bool(const std::string& step, std::uint64_t done, std::uint64_t total)>& progress);

} // namespace obscura::tools
