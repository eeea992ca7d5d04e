// SPDX-License-Identifier: Apache-2.0
// FITS file writer on cfitsio for the writers in this folder; the file appears complete or not at all.
#pragma once

#include "images/writers/card.hpp"
#include "images/writers/pending_file.hpp"

#include <fitsio.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::images {

/// Writes to a temporary file that commit() renames. All members throw OutputError.
class FitsWriter {
public:
    explicit FitsWriter(const std::filesystem::path& file) : pending_(file) {
        // Remove the empty file that PendingFile made: fits_create_diskfile, which parses no filters in the
        // name, refuses an existing file.
        std::error_code ignored; // it refuses the file then
        std::filesystem::remove(pending_.path(), ignored);
        fits_create_diskfile(&fits_, pending_.path().c_str(), &status_);
        check();
    }
    ~FitsWriter() {
        int ignored = 0;
        if (fits_ != nullptr) fits_delete_file(fits_, &ignored);
    }
    FitsWriter(const FitsWriter&) = delete;
    FitsWriter& operator=(const FitsWriter&) = delete;

    void create_image(int type, std::int32_t width, std::int32_t height, std::int32_t planes) {
        std::array<long, 3> size{width, height, planes};
        fits_create_img(fits_, type, planes > 1 ? 3 : 2, size.data(), &status_);
        check();
    }
    void write(const Card& card) {
        const char* comment = card.comment.c_str();
        if (const auto* text = std::get_if<std::string>(&card.value)) {
            fits_write_key_longwarn(fits_, &status_);
            fits_write_key_longstr(fits_, card.key.c_str(), text->c_str(), comment, &status_);
        } else if (const auto* flag = std::get_if<bool>(&card.value)) {
            int value = *flag ? 1 : 0;
            fits_write_key(fits_, TLOGICAL, card.key.c_str(), &value, comment, &status_);
        } else if (const auto* whole = std::get_if<std::int64_t>(&card.value)) {
            LONGLONG value = *whole;
            fits_write_key(fits_, TLONGLONG, card.key.c_str(), &value, comment, &status_);
        } else {
            double value = std::get<double>(card.value);
            // FITS headers cannot represent NaN or infinity.
            if (std::isfinite(value))
                fits_write_key_dbl(fits_, card.key.c_str(), value, -15, comment, &status_);
        }
        check();
    }
    void write_pixels(int type, std::size_t count, const void* values) {
        // cfitsio does not write through the pointer.
        fits_write_img(fits_, type, 1, static_cast<LONGLONG>(count), const_cast<void*>(values), &status_);
        check();
    }
    /// Column of a binary table; `form` is TFORM of the FITS standard, such as "1J", "1K", "1D".
    struct Column {
        const char* name;
        const char* form;
        const char* unit;
    };
    void create_table(const char* name, std::size_t rows, const std::vector<Column>& columns) {
        std::vector<char*> names, forms, units;
        for (const Column& c : columns) { // cfitsio writes to none of them
            names.push_back(const_cast<char*>(c.name));
            forms.push_back(const_cast<char*>(c.form));
            units.push_back(const_cast<char*>(c.unit));
        }
        fits_create_tbl(fits_, BINARY_TBL, static_cast<LONGLONG>(rows), static_cast<int>(columns.size()),
                        names.data(), forms.data(), units.data(), name, &status_);
        check();
    }
    void write_column(int column, const std::vector<std::int64_t>& values) {
        std::vector<LONGLONG> copy(values.begin(), values.end());
        write_cells(column, TLONGLONG, copy.size(), copy.data());
    }
    void write_column(int column, std::vector<double> values) {
        write_cells(column, TDOUBLE, values.size(), values.data());
    }
    void write_column(int column, const std::vector<std::string>& values) {
        std::vector<char*> texts; // cfitsio does not write to them
        for (const std::string& value : values)
            texts.push_back(const_cast<char*>(value.c_str()));
        write_cells(column, TSTRING, texts.size(), texts.data());
    }
    void commit() {
        fits_close_file(fits_, &status_);
        fits_ = nullptr;
        check();
        pending_.commit();
    }

private:
    void write_cells(int column, int type, std::size_t count, void* values) {
        if (count > 0)
            fits_write_col(fits_, type, column, 1, 1, static_cast<LONGLONG>(count), values, &status_);
        check();
    }
    void check() {
        if (status_ == 0) return;
        char text[FLEN_ERRMSG] = {};
        fits_read_errmsg(text);
        if (text[0] == '\0') fits_get_errstatus(status_, text);
        fits_clear_errmsg();
        pending_.fail(text);
    }

    PendingFile pending_;
    fitsfile* fits_ = nullptr;
    int status_ = 0;
};

} // namespace obscura::images
