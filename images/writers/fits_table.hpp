// SPDX-License-Identifier: Apache-2.0
// FITS binary table of numbers.
#pragma once

#include "images/writers/card.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace obscura::images {

/// A column of doubles; all columns of a table are as long.
struct FitsTableColumn {
    std::string name;
    std::string unit;
    std::vector<double> values;
};

/// Writes the columns as the binary table `name`, the cards in the primary header. The file appears complete
/// or not at all. Throws OutputError.
void write_fits_table(const std::filesystem::path& file, const std::string& name,
                      const std::vector<FitsTableColumn>& columns, const Cards& cards);

} // namespace obscura::images
