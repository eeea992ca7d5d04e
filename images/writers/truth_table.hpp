// SPDX-License-Identifier: Apache-2.0
// Truth tables of a series of frames as one CSV or FITS file.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/scene_truth.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace obscura::images {

class FitsWriter;

/// Value of a cell; a NaN is not known.
using TruthCell = std::variant<std::int64_t, double, std::string_view>;

/// Column of the table of objects; see docs/truth.md.
struct TruthColumn {
    std::string_view name; ///< in CSV files; in FITS files in capitals
    std::string_view unit;
    std::string_view form; ///< of a FITS table, TFORM
    TruthCell (*cell)(const SceneTruth& truth, const TruthEntry& entry);
};
[[nodiscard]] std::span<const TruthColumn> truth_columns();

/// A cell as text: positions to 1e-5 px, other reals to 10 digits; empty: not known.
[[nodiscard]] std::string truth_text(const TruthColumn& column, const TruthCell& cell);

/// First line of a CSV file, with its end.
[[nodiscard]] std::string truth_csv_header();
/// Lines of one frame. `rows`: of the composed image; rows of equal times share a line.
[[nodiscard]] std::string truth_csv_lines(const SceneTruth& truth, std::span<const RowTime> rows);

/// Collects the truth tables of frames and writes them to one file, which appears complete or not at all.
class TruthTableFile {
public:
    /// The name's ending selects the format, .csv or .fits. Throws OutputError for any other, and if the
    /// folder is not writable.
    explicit TruthTableFile(std::filesystem::path file);

    /// `rows`: of the composed image; rows of equal times share an entry.
    void add(SceneTruth truth, std::span<const RowTime> rows);
    /// Throws OutputError.
    void write() const;

private:
    struct FrameTable {
        SceneTruth truth;
        std::vector<RowTime> rows;
    };
    void write_csv() const;
    void write_fits() const;
    void write_entries(FitsWriter& writer) const;
    void write_poses(FitsWriter& writer) const;
    void write_rows(FitsWriter& writer) const;

    std::filesystem::path file_;
    std::vector<FrameTable> frames_;
};

} // namespace obscura::images
