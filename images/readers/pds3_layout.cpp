// SPDX-License-Identifier: Apache-2.0
#include "images/readers/pds3_layout.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/text/number.hpp"
#include "core/text/text.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

namespace obscura::images {
namespace {

/// Bytes of the largest file that a label may describe; sums with it stay far from overflow.
constexpr std::int64_t largest_file = std::int64_t{1} << 40;

/// Keywords of numbers that are no measurement (Planetary Science Data Dictionary; names without CORE_ and
/// with MISSING, NULL, INVALID and DUMMY alone are of older labels, those with VALUE of SELENE's).
constexpr std::array<std::string_view, 24> pds3_missing_keys{"MISSING_CONSTANT",
                                                             "INVALID_CONSTANT",
                                                             "NULL_CONSTANT",
                                                             "NOT_APPLICABLE_CONSTANT",
                                                             "UNKNOWN_CONSTANT",
                                                             "ERROR_CONSTANT",
                                                             "SATURATED_CONSTANT",
                                                             "MISSING",
                                                             "INVALID",
                                                             "NULL",
                                                             "DUMMY",
                                                             "INVALID_VALUE",
                                                             "OUT_OF_IMAGE_BOUNDS_VALUE",
                                                             "CORE_MISSING_CONSTANT",
                                                             "CORE_INVALID_CONSTANT",
                                                             "CORE_NULL",
                                                             "CORE_LOW_REPR_SATURATION",
                                                             "CORE_LOW_INSTR_SATURATION",
                                                             "CORE_HIGH_REPR_SATURATION",
                                                             "CORE_HIGH_INSTR_SATURATION",
                                                             "LOW_REPR_SATURATION",
                                                             "LOW_INSTR_SATURATION",
                                                             "HIGH_REPR_SATURATION",
                                                             "HIGH_INSTR_SATURATION"};

[[noreturn]] void refuse_label(const PdsLabel& label, const std::string& what) {
    throw InputError(fmt::format("{}: {}", label.file().string(), what));
}

/// Encoding by SAMPLE_TYPE and SAMPLE_BITS (Standards Reference v3.8, table 3.2 and appendix C). Types
/// without a name of a machine have the most significant byte first.
PdsSampleType pds3_sample_type(const PdsLabel& label) {
    const std::string name = upper_case(label.text("IMAGE.SAMPLE_TYPE", "UNSIGNED_INTEGER"));
    const std::int64_t bits = label.integer("IMAGE.SAMPLE_BITS");
    using Kind = PdsSampleType::Kind;
    PdsSampleType type;
    type.bytes = static_cast<std::size_t>(bits) / 8;
    const auto has = [&](const char* part) { return name.find(part) != std::string::npos; };
    const bool real = has("REAL") || has("FLOAT") || has("DOUBLE");
    if (real && has("VAXG"))
        type.kind = Kind::vax_g;
    else if (real && has("VAX"))
        type.kind = Kind::vax;
    else if (real)
        type.kind = Kind::real;
    else if (!has("UNSIGNED"))
        type.kind = Kind::signed_integer;
    type.little_endian = has("LSB") || has("PC_") || has("VAX");
    const bool size_known = type.kind == Kind::vax_g ? bits == 64
                            : real                   ? bits == 32 || bits == 64
                                                     : bits == 8 || bits == 16 || bits == 32 || bits == 64;
    if (!size_known || has("COMPLEX") || !(real || has("INTEGER")))
        refuse_label(
            label,
            fmt::format(
                "samples of type {} with {} bits cannot be read, allowed are integers of 8, 16, 32 and 64 bits and reals of 32 and 64 bits (IEEE, VAX)",
                name.substr(0, 60), bits));
    return type;
}

/// Sets the steps from pixel to pixel, line to line and band to band.
void set_steps(const PdsLabel& label, Pds3Layout& at) {
    const std::int64_t prefix = label.integer("IMAGE.LINE_PREFIX_BYTES", 0),
                       suffix = label.integer("IMAGE.LINE_SUFFIX_BYTES", 0);
    const auto possible = [](std::int64_t n, std::int64_t most) { return n >= 0 && n <= most; };
    if (!possible(prefix, 1 << 20) || !possible(suffix, 1 << 20) || !possible(at.bands - 1, 65535) ||
        !possible(at.width - 1, largest_file) || !possible(at.height - 1, largest_file))
        refuse_label(label, "the label's image layout is invalid");
    const auto sample = static_cast<std::int64_t>(at.type.bytes);
    std::string storage = upper_case(label.text("IMAGE.BAND_STORAGE_TYPE", "BAND_SEQUENTIAL"));
    std::replace(storage.begin(), storage.end(), ' ', '_'); // labels of SELENE
    const bool by_sample = at.bands > 1 && storage == "SAMPLE_INTERLEAVED",
               by_line = at.bands > 1 && storage == "LINE_INTERLEAVED";
    if (at.bands > 1 && !by_sample && !by_line && storage != "BAND_SEQUENTIAL" && !says_nothing(storage))
        refuse_label(
            label,
            fmt::format(
                "BAND_STORAGE_TYPE is {}, allowed BAND_SEQUENTIAL, LINE_INTERLEAVED, SAMPLE_INTERLEAVED",
                storage.substr(0, 60)));
    at.pixel_bytes = by_sample ? sample * at.bands : sample;
    if (at.width > largest_file / at.pixel_bytes) refuse_label(label, "the label's image layout is invalid");
    const std::int64_t line = prefix + at.width * at.pixel_bytes + suffix;
    if (line > largest_file / at.bands / at.height)
        refuse_label(label, "the label's image layout is invalid");
    at.line_bytes = by_line ? line * at.bands : line;
    at.band_bytes = by_sample ? sample : by_line ? line : line * at.height;
    at.offset += prefix;
    at.end = at.offset + (at.bands - 1) * at.band_bytes + (at.height - 1) * at.line_bytes +
             (at.width - 1) * at.pixel_bytes + sample;
}

/// Finds the data file and the byte offset that ^IMAGE points to.
void locate(const PdsLabel& label, std::filesystem::path& data, std::int64_t& offset) {
    const std::vector<std::string> pointer = label.list("^IMAGE");
    data = label.file();
    std::string place = pointer.front();
    if (place.find_first_not_of("0123456789") != std::string::npos) {
        // Try other cases: names on the archive's discs are upper case, names of their copies often not.
        for (const std::string& name : {place, lower_case(place), upper_case(place)}) {
            // Use the file name only, so that a label cannot refer to files outside its folder.
            data = label.file().parent_path() / std::filesystem::path(name).filename();
            if (path_exists(data)) break;
        }
        place = pointer.size() > 1 ? pointer[1] : "1";
    }
    offset = 0;
    const auto unit = place.find('<');
    const bool in_bytes = label.unit("^IMAGE") == "BYTES";
    const std::string digits = place.substr(0, unit == std::string::npos ? place.size() : unit);
    try {
        offset = std::stoll(digits);
    } catch (const std::exception&) {
        throw InputError(fmt::format("{}: ^IMAGE is not a valid pointer", label.file().string()));
    }
    if (offset < 1) throw InputError(fmt::format("{}: ^IMAGE points before the file", label.file().string()));
    offset -= 1;
    if (offset == 0) return; // whatever a record is
    const std::int64_t record = in_bytes ? 1 : label.integer("RECORD_BYTES");
    if (record < 1)
        throw InputError(fmt::format("{}: RECORD_BYTES {} is out of range", label.file().string(), record));
    if (offset > largest_file / record)
        throw InputError(fmt::format("{}: ^IMAGE points behind any file", label.file().string()));
    offset *= record;
}

/// Prefix of the keywords of the image's object: a qube has others for the same.
std::string image_object(const PdsLabel& label) {
    if (!label.has("IMAGE.LINES"))
        for (const char* qube : {"SPECTRAL_QUBE.", "QUBE."})
            if (label.has(qube + std::string("AXES"))) return qube;
    return "IMAGE.";
}

} // namespace

Pds3Layout pds3_layout(const PdsLabel& label) {
    Pds3Layout at;
    const std::string encoding = label.text("IMAGE.ENCODING_TYPE", "");
    if (!says_nothing(encoding))
        refuse_label(label, fmt::format("its image is compressed (ENCODING_TYPE {}), which cannot be read; "
                                        "gdal_translate may make a TIFF file of it",
                                        encoding.substr(0, 60)));
    at.label = label.file();
    at.width = label.integer("IMAGE.LINE_SAMPLES");
    at.height = label.integer("IMAGE.LINES");
    at.bands = label.integer("IMAGE.BANDS", 1);
    at.type = pds3_sample_type(label);
    locate(label, at.data, at.offset);
    set_steps(label, at);
    return at;
}

PdsNumbers pds3_values(const PdsLabel& label) {
    PdsNumbers numbers;
    const std::string object = image_object(label);
    const bool image = object == "IMAGE.";
    const std::string scale = object + (image ? "SCALING_FACTOR" : "CORE_MULTIPLIER"),
                      offset = object + (image ? "OFFSET" : "CORE_BASE");
    const auto number = [&](const std::string& key, double otherwise) {
        return says_nothing(label.text(key, "")) ? otherwise : label.number(key, otherwise);
    };
    numbers.scaled = label.has(scale) || label.has(offset);
    numbers.scale = number(scale, 1);
    numbers.offset = number(offset, 0);
    numbers.unit = label.text(object + (image ? "UNIT" : "CORE_UNIT"), "");
    if (says_nothing(numbers.unit)) numbers.unit.clear();
    for (const auto& [key, stated] :
         {std::pair{"MINIMUM", &numbers.stated_least}, {"MAXIMUM", &numbers.stated_largest}})
        *stated = decimal_number(label.text(object + key, ""));
    return numbers;
}

PdsNumbers pds3_numbers(const PdsLabel& label, const PdsSampleType& type) {
    PdsNumbers numbers = pds3_values(label);
    const std::string object = image_object(label);
    for (const std::string_view name : pds3_missing_keys) {
        const std::string key = object + std::string(name);
        if (!label.has(key)) continue;
        for (const std::string& text : label.list(key)) {
            if (says_nothing(text)) continue;
            const std::optional<double> missing = sample_constant(type, text);
            if (missing)
                numbers.missing.push_back(*missing);
            else if (!decimal_number(text)) // a number that no sample can be marks none
                refuse_label(
                    label, fmt::format(
                               "{} is \"{}\", allowed are numbers and bit patterns of {} bits such as 16#80#",
                               key, text.substr(0, 60), 8 * type.bytes));
        }
    }
    std::sort(numbers.missing.begin(), numbers.missing.end());
    numbers.missing.erase(std::unique(numbers.missing.begin(), numbers.missing.end()), numbers.missing.end());
    if (const std::string text = label.text(object + "CORE_VALID_MINIMUM", ""); !says_nothing(text))
        numbers.min_valid = sample_constant(type, text).value_or(numbers.min_valid);
    return numbers;
}

Pds3Samples::Pds3Samples(const Pds3Layout& layout) : at_(layout), file_(open_input(layout.data)) {
    std::error_code error;
    const auto size = static_cast<std::int64_t>(std::filesystem::file_size(at_.data, error));
    if (error || size < at_.end)
        throw InputError(fmt::format("{}: {} bytes, its label {} describes an image up to byte {}",
                                     at_.data.string(), error ? 0 : size, at_.label.string(), at_.end));
}

void Pds3Samples::read(std::int64_t band, std::int64_t x, std::int64_t y, std::span<double> out) {
    if (out.empty()) return;
    bytes_.resize((out.size() - 1) * static_cast<std::size_t>(at_.pixel_bytes) + at_.type.bytes);
    const std::int64_t start = at_.offset + band * at_.band_bytes + y * at_.line_bytes + x * at_.pixel_bytes;
    for (std::size_t done = 0; done < bytes_.size();) {
        const ssize_t got = ::pread(fileno(file_.get()), bytes_.data() + done, bytes_.size() - done,
                                    static_cast<off_t>(start + static_cast<std::int64_t>(done)));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0)
            throw InputError(fmt::format("{}: cannot be read: {}", at_.data.string(), std::strerror(errno)),
                             errno);
        if (got == 0)
            throw InputError(fmt::format("{}: ends in line {} of {}", at_.data.string(), y + 1, at_.height));
        done += static_cast<std::size_t>(got);
    }
    decode_samples(at_.type, bytes_.data(), static_cast<std::size_t>(at_.pixel_bytes), out);
}

} // namespace obscura::images
