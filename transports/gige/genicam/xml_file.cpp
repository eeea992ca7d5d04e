// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/genicam/xml_file.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/text_file.hpp"
#include "core/text/text.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <new>
#include <string_view>
#include <system_error>

namespace obscura::transports::gige {
namespace {

/// Limit of the file and of the XML in it, in bytes.
constexpr std::uint64_t xml_bytes_max = 16U << 20;

// Records of a zip archive: APPNOTE.TXT of PKWARE, version 6.3.10, sections 4.3.7, 4.3.12 and 4.3.16.
constexpr std::uint32_t local_signature = 0x04034b50, entry_signature = 0x02014b50,
                        end_signature = 0x06054b50;
constexpr std::size_t local_bytes = 30, entry_bytes = 46, end_bytes = 22;
constexpr std::uint32_t method_stored = 0, method_deflated = 8, flag_encrypted = 1;

[[noreturn]] void refuse_archive(std::string_view why) {
    throw ConfigError(fmt::format("zip archive: {}", why));
}

/// Little-endian number of `bytes` bytes. Throws ConfigError beyond the end of `from`.
std::uint32_t number_at(std::string_view from, std::size_t at, std::size_t bytes) {
    if (at > from.size() || from.size() - at < bytes) refuse_archive("ends too early");
    std::uint32_t number = 0;
    for (std::size_t i = bytes; i-- > 0;)
        number = number << 8 | static_cast<unsigned char>(from[at + i]);
    return number;
}

std::string_view bytes_at(std::string_view from, std::size_t at, std::size_t bytes) {
    if (at > from.size() || from.size() - at < bytes) refuse_archive("ends too early");
    return from.substr(at, bytes);
}

/// A file of the archive, by its central directory.
struct ZipEntry {
    std::string_view name;
    std::uint32_t flags = 0, method = 0, crc = 0, packed_bytes = 0, plain_bytes = 0, local_at = 0;
};

/// The only file of the archive whose name ends with .xml; if there is none, its only file.
ZipEntry xml_entry_of(std::string_view zip) {
    // A comment or padding may follow the record at the end.
    const std::size_t end = zip.rfind("PK\x05\x06");
    if (end == std::string_view::npos || zip.size() - end < end_bytes) refuse_archive("has no directory");
    const std::uint32_t count = number_at(zip, end + 10, 2);
    std::size_t at = number_at(zip, end + 16, 4), files = 0, xml_files = 0;
    ZipEntry only, xml;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (number_at(zip, at, 4) != entry_signature) refuse_archive("its directory is damaged");
        const std::size_t name_bytes = number_at(zip, at + 28, 2);
        const ZipEntry entry{.name = bytes_at(zip, at + entry_bytes, name_bytes),
                             .flags = number_at(zip, at + 8, 2),
                             .method = number_at(zip, at + 10, 2),
                             .crc = number_at(zip, at + 16, 4),
                             .packed_bytes = number_at(zip, at + 20, 4),
                             .plain_bytes = number_at(zip, at + 24, 4),
                             .local_at = number_at(zip, at + 42, 4)};
        at += entry_bytes + name_bytes + number_at(zip, at + 30, 2) + number_at(zip, at + 32, 2);
        if (entry.name.ends_with('/')) continue;
        ++files;
        only = entry;
        if (!lower_case(entry.name).ends_with(".xml")) continue;
        ++xml_files;
        xml = entry;
    }
    if (xml_files == 1) return xml;
    if (xml_files > 1 || files != 1)
        refuse_archive(fmt::format("holds {} files, {} of them *.xml, wanted is one", files, xml_files));
    return only;
}

/// Raw deflate stream of exactly `plain_bytes` bytes.
std::string inflated(std::string_view packed, std::size_t plain_bytes) {
    std::string plain(plain_bytes, '\0');
    z_stream stream{};
    if (::inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data())); // NOLINT: only read
    stream.avail_in = static_cast<uInt>(packed.size());
    stream.next_out = reinterpret_cast<Bytef*>(plain.data());
    stream.avail_out = static_cast<uInt>(plain.size());
    const int state = ::inflate(&stream, Z_FINISH);
    const std::size_t left = stream.avail_out;
    ::inflateEnd(&stream);
    if (state != Z_STREAM_END || left != 0) refuse_archive("its data is damaged");
    return plain;
}

/// The XML in an archive. Throws ConfigError.
std::string unzipped_xml(std::string_view zip) {
    const ZipEntry entry = xml_entry_of(zip);
    if ((entry.flags & flag_encrypted) != 0) refuse_archive("is encrypted");
    if (entry.method != method_stored && entry.method != method_deflated)
        refuse_archive(
            fmt::format("compression method {}, allowed are 0 (stored) and 8 (deflated)", entry.method));
    if (entry.plain_bytes == 0 || entry.plain_bytes > xml_bytes_max)
        refuse_archive(
            fmt::format("{} bytes when unpacked, allowed are 1 to {}", entry.plain_bytes, xml_bytes_max));
    if (number_at(zip, entry.local_at, 4) != local_signature) refuse_archive("its directory is damaged");
    const std::size_t data_at = entry.local_at + local_bytes + number_at(zip, entry.local_at + 26, 2) +
                                number_at(zip, entry.local_at + 28, 2);
    const std::string_view packed = bytes_at(zip, data_at, entry.packed_bytes);
    if (entry.method == method_stored && entry.packed_bytes != entry.plain_bytes)
        refuse_archive("its directory is damaged");
    std::string plain =
        entry.method == method_stored ? std::string(packed) : inflated(packed, entry.plain_bytes);
    if (::crc32(0, reinterpret_cast<const Bytef*>(plain.data()), static_cast<uInt>(plain.size())) !=
        entry.crc)
        refuse_archive("its checksum is another");
    return plain;
}

std::string bytes_of_file(const std::string& file) {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    if (error) throw ConfigError(error.message());
    if (bytes == 0 || bytes > xml_bytes_max)
        throw ConfigError(fmt::format("{} bytes, allowed are 1 to {}", bytes, xml_bytes_max));
    note_input(file);
    std::string contents(bytes, '\0');
    std::ifstream in(file, std::ios::binary);
    in.read(contents.data(), static_cast<std::streamsize>(bytes));
    if (!in) throw ConfigError("cannot be read");
    return contents;
}

} // namespace

std::string contents_of_genicam_file(const std::string& file) {
    try {
        std::string contents = bytes_of_file(file);
        if (contents.starts_with("PK")) contents = unzipped_xml(contents);
        if (const std::string why = make_plain_text(contents); !why.empty()) throw ConfigError(why);
        if (contents.empty()) throw ConfigError("is empty");
        return contents;
    } catch (const ConfigError& e) {
        throw ConfigError(fmt::format("{}: {}", file, e.what()));
    }
}

} // namespace obscura::transports::gige
