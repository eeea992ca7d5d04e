// SPDX-License-Identifier: Apache-2.0
#include "images/writers/fits_table.hpp"

#include "images/writers/fits_writer.hpp"

namespace obscura::images {

void write_fits_table(const std::filesystem::path& file, const std::string& name,
                      const std::vector<FitsTableColumn>& columns, const Cards& cards) {
    FitsWriter out(file);
    out.create_image(BYTE_IMG, 0, 0, 1);
    for (const Card& card : cards)
        out.write(card);
    std::vector<FitsWriter::Column> heads;
    for (const FitsTableColumn& column : columns)
        heads.push_back({column.name.c_str(), "1D", column.unit.c_str()});
    out.create_table(name.c_str(), columns.empty() ? 0 : columns.front().values.size(), heads);
    for (std::size_t c = 0; c < columns.size(); ++c)
        out.write_column(static_cast<int>(c) + 1, columns[c].values);
    out.commit();
}

} // namespace obscura::images
