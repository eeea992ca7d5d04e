// SPDX-License-Identifier: Apache-2.0
#include "images/readers/truth_table_reader.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/io/text_file.hpp"

#include <fitsio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <memory>
#include <sstream>
#include <utility>

namespace obscura::images {
namespace {

/// Bounds the memory that a hostile file can request.
constexpr std::size_t max_line_bytes = 65536;
constexpr std::size_t max_table_bytes = std::size_t{4} << 30;
constexpr long max_table_rows = 100'000'000;
constexpr int max_columns = 256;

/// Cells of a line of a CSV file.
std::vector<std::string> csv_cells(const std::string& line) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (quoted && line[i] == '"' && i + 1 < line.size() && line[i + 1] == '"')
            cells.back() += line[++i];
        else if (line[i] == '"')
            quoted = !quoted;
        else if (line[i] == ',' && !quoted)
            cells.emplace_back();
        else if (line[i] != '\r')
            cells.back() += line[i];
    }
    return cells;
}

TruthLines read_csv_table(const std::filesystem::path& file, const std::string& frame) {
    std::string content;
    if (const std::string why = read_plain_text(file, max_table_bytes, content); !why.empty())
        throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), why), errno);
    std::istringstream in(content);
    TruthLines out;
    std::size_t number = 0, frame_column = 0, kind_column = 0;
    for (std::string line; std::getline(in, line);) {
        ++number;
        if (line.size() > max_line_bytes)
            throw InputError(fmt::format("{}:{}: a line of {} bytes: allowed are {}", file.string(), number,
                                         line.size(), max_line_bytes));
        std::vector<std::string> cells = csv_cells(line);
        if (out.columns.empty()) {
            out.columns = std::move(cells);
            frame_column = out.column("frame"), kind_column = out.column("kind");
            if (std::max(frame_column, kind_column) >= out.columns.size())
                throw InputError(fmt::format("{}:{}: no columns frame and kind: not a truth table",
                                             file.string(), number));
            continue;
        }
        if (cells.size() != out.columns.size())
            throw InputError(fmt::format("{}:{}: {} cells: allowed are {}, as in its first line",
                                         file.string(), number, cells.size(), out.columns.size()));
        if (!frame.empty() && cells[frame_column] != frame) continue;
        if (cells[kind_column] == "pose" || cells[kind_column] == "rows") continue;
        out.lines.push_back(std::move(cells));
    }
    // The columns of poses are empty now.
    const std::size_t poses = std::min(out.column("position_x_m"), out.columns.size());
    out.columns.resize(poses);
    for (std::vector<std::string>& line : out.lines)
        line.resize(poses);
    return out;
}

/// FITS file whose table TRUTH is the current unit.
class FitsTable {
public:
    explicit FitsTable(const std::filesystem::path& file) : file_(file) {
        fits_open_diskfile(&fits_, file.c_str(), READONLY, &status_);
        std::array<char, 6> name{"TRUTH"};
        fits_movnam_hdu(fits_, BINARY_TBL, name.data(), 0, &status_);
        fits_get_num_rows(fits_, &rows_, &status_);
        fits_get_num_cols(fits_, &columns_, &status_);
        long width = 0;
        fits_read_key(fits_, TLONG, "NAXIS1", &width, nullptr, &status_);
        check();
        const auto bytes = static_cast<long>(file_bytes_at(file));
        if (rows_ > 0 && (width < 1 || rows_ > bytes / width))
            throw InputError(fmt::format("{}: TRUTH: {} rows of {} bytes in a file of {}", file.string(),
                                         rows_, width, bytes));
        if (rows_ < 0 || rows_ > max_table_rows || columns_ < 1 || columns_ > max_columns)
            throw InputError(fmt::format("{}: TRUTH: {} rows, {} columns: allowed are {} and {}",
                                         file.string(), rows_, columns_, max_table_rows, max_columns));
    }
    ~FitsTable() {
        int ignored = 0;
        if (fits_ != nullptr) fits_close_file(fits_, &ignored);
        fits_clear_errmsg();
    }
    FitsTable(const FitsTable&) = delete;
    FitsTable& operator=(const FitsTable&) = delete;

    [[nodiscard]] long rows() const { return rows_; }
    [[nodiscard]] int columns() const { return columns_; }
    [[nodiscard]] std::string name(int column) {
        std::array<char, FLEN_VALUE> name{};
        fits_get_bcolparms(fits_, column, name.data(), nullptr, nullptr, nullptr, nullptr, nullptr, nullptr,
                           nullptr, &status_);
        check();
        std::string out = name.data();
        for (char& c : out)
            c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        return out;
    }
    [[nodiscard]] std::string cell(int column, long row) {
        int type = 0;
        long repeat = 0, width = 0;
        fits_get_coltype(fits_, column, &type, &repeat, &width, &status_);
        check();
        int any = 0;
        if (type == TSTRING) {
            if (repeat < 0 || repeat > static_cast<long>(max_line_bytes))
                fail("a column of text is too wide");
            std::string text(static_cast<std::size_t>(repeat) + 1, '\0');
            char* at = text.data();
            fits_read_col(fits_, TSTRING, column, row, 1, 1, nullptr, &at, &any, &status_);
            check();
            return text.c_str();
        }
        if (repeat != 1) fail("a column of more than one value");
        if (type == TDOUBLE || type == TFLOAT) {
            double value = 0;
            fits_read_col(fits_, TDOUBLE, column, row, 1, 1, nullptr, &value, &any, &status_);
            check();
            return std::isnan(value) ? std::string() : fmt::format("{:.10g}", value);
        }
        LONGLONG value = 0;
        fits_read_col(fits_, TLONGLONG, column, row, 1, 1, nullptr, &value, &any, &status_);
        check();
        return fmt::format("{}", value);
    }
    [[noreturn]] void fail(std::string_view what) const {
        throw InputError(fmt::format("{}: TRUTH: {}", file_.string(), what));
    }

private:
    void check() {
        if (status_ == 0) return;
        std::array<char, FLEN_STATUS> text{};
        fits_get_errstatus(status_, text.data());
        fail(text.data());
    }

    std::filesystem::path file_;
    fitsfile* fits_ = nullptr;
    int status_ = 0, columns_ = 0;
    long rows_ = 0;
};

TruthLines read_fits_table(const std::filesystem::path& file, const std::string& frame) {
    FitsTable table(file);
    TruthLines out;
    for (int c = 1; c <= table.columns(); ++c)
        out.columns.push_back(table.name(c));
    const std::size_t frame_column = out.column("frame");
    if (frame_column == out.columns.size()) table.fail("no column FRAME");
    for (long row = 1; row <= table.rows(); ++row) {
        if (!frame.empty() && table.cell(static_cast<int>(frame_column) + 1, row) != frame) continue;
        std::vector<std::string>& line = out.lines.emplace_back();
        for (int c = 1; c <= table.columns(); ++c)
            line.push_back(table.cell(c, row));
    }
    return out;
}

} // namespace

std::size_t TruthLines::column(std::string_view name) const {
    return static_cast<std::size_t>(std::find(columns.begin(), columns.end(), name) - columns.begin());
}

bool is_truth_table(const std::filesystem::path& file) {
    if (file.extension() == ".csv") return true;
    if (file.extension() != ".fits") return false;
    fitsfile* fits = nullptr;
    int status = 0, ignored = 0;
    fits_open_diskfile(&fits, file.c_str(), READONLY, &status);
    int axes = -1;
    // A picture has its pixels in the first unit. The table is not looked for: where it is damaged, reading
    // says so.
    fits_get_img_dim(fits, &axes, &status);
    if (fits != nullptr) fits_close_file(fits, &ignored);
    fits_clear_errmsg();
    return status == 0 && axes == 0;
}

TruthLines read_truth_table(const std::filesystem::path& file, const std::string& frame) {
    return file.extension() == ".csv" ? read_csv_table(file, frame) : read_fits_table(file, frame);
}

} // namespace obscura::images
