// SPDX-License-Identifier: Apache-2.0
// DAF, the container of binary SPICE kernels (SPK, CK, PCK), and its text form, the transfer format.
//
// Own code: Debian 12 has neither CSPICE nor a development package of CALCEPH.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace obscura::ephemeris {

/// Content of a DAF file (NAIF, DAF Required Reading): arrays of doubles, each with a summary. The
/// file is read as a whole and may change while it is in use. Immutable, thread-safe; copies share the
/// content.
class Daf {
public:
    /// One array: a segment of a kernel.
    struct Array {
        std::string name;                   ///< segment identifier
        std::vector<double> doubles;        ///< of the summary
        std::vector<std::int32_t> integers; ///< of the summary, without the two addresses
        std::span<const double> words;      ///< the data; valid as long as a copy of the Daf exists
        std::string place;                  ///< "FILE: segment 3 (NAME)", for messages
    };

    /// Reads a binary file of either byte order, or a transfer file. Throws InputError if the file is not a
    /// DAF, is damaged, or ends before the data that its summaries promise.
    explicit Daf(const std::filesystem::path& file);

    /// "SPK", "CK" or "PCK".
    [[nodiscard]] const std::string& kind() const { return kind_; }
    [[nodiscard]] const std::vector<Array>& arrays() const { return arrays_; }

    /// Whether a file begins as a DAF does, as binary or as transfer file.
    [[nodiscard]] static bool starts_as_daf(const std::filesystem::path& file);

private:
    void read_binary(std::shared_ptr<const std::byte[]> bytes, std::size_t size);
    void read_transfer();

    std::string file_, kind_;
    std::shared_ptr<const void> storage_;
    std::vector<Array> arrays_;
};

} // namespace obscura::ephemeris
