// SPDX-License-Identifier: Apache-2.0
// Samples of planetary images (PDS3, PDS4): encodings, and the numbers that constants of labels stand for.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::images {

/// Encoding of a sample in the file.
struct PdsSampleType {
    enum class Kind : std::uint8_t {
        unsigned_integer,
        signed_integer,
        real,  ///< IEEE 754
        vax,   ///< VAX F_floating (32 bits) or D_floating (64 bits)
        vax_g, ///< VAX G_floating (64 bits)
    };
    Kind kind = Kind::unsigned_integer;
    bool little_endian = false;
    std::size_t bytes = 1; ///< 1, 2, 4 or 8

    [[nodiscard]] bool is_real() const { return kind >= Kind::real; }
};

/// Decodes `out.size()` samples, the first at `from`, each `stride` bytes after the one before. VAX numbers
/// that are reserved become NaN. Real-time safe.
void decode_samples(const PdsSampleType& type, const std::uint8_t* from, std::size_t stride,
                    std::span<double> out);

/// The number of a sample that a label's constant stands for: a decimal number as the sample holds it (a real
/// of 32 bits rounds it), or a bit pattern of the sample in radix form, "16#8000#", "2#101#", "8#17#"
/// (Standards Reference v3.8, 12.3.4) or "0x8000" (PDS4). A radix form with a sign ("16#-8000#", "-16#8000#")
/// is a number. Empty: it is none of these, or no sample can hold it.
[[nodiscard]] std::optional<double> sample_constant(const PdsSampleType& type, std::string_view text);

/// A number as a sample holds it: rounded in reals of 32 bits; empty: no sample can be that.
[[nodiscard]] std::optional<double> as_sample(const PdsSampleType& type, double number);

/// Whether a label's text in place of a number says that there is none ("N/A", "UNK", "NULL").
[[nodiscard]] bool says_nothing(std::string_view text);

/// What the numbers of samples are. Value = offset + scale * number.
struct PdsNumbers {
    double scale = 1, offset = 0;
    bool scaled = false;         ///< scale or offset are stated
    std::string unit;            ///< as stated; empty: it is not
    std::vector<double> missing; ///< numbers of samples without data, each once
    double min_valid = -std::numeric_limits<double>::infinity();
    double largest_valid = std::numeric_limits<double>::infinity();
    /// Range of all numbers that the label states.
    std::optional<double> stated_least, stated_largest;

    /// Whether scale and offset make values.
    [[nodiscard]] bool possible() const {
        return std::abs(scale) > 0 && std::isfinite(scale) && std::isfinite(offset);
    }
    /// The number; NaN if it stands for a missing sample. Reals of 1e30 and more are none, as special numbers
    /// of ISIS are. Real-time safe.
    [[nodiscard]] double valid(double number) const {
        bool valid = std::abs(number) < 1e30 && number >= min_valid && number <= largest_valid;
        for (const double m : missing)
            valid = valid && number != m;
        return valid ? number : std::numeric_limits<double>::quiet_NaN();
    }
};

} // namespace obscura::images
