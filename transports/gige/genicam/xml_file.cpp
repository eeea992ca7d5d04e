// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/genicam/xml_file.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/io/text_file.hpp"
#include "core/text/text.hpp"

#include <fmt/format.h>
#include <unzip.h>
#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

namespace obscura::transports::gige {
namespace {

/// Limit of the file and of the XML in it, in bytes.
constexpr std::uint64_t xml_bytes_max = 16U << 20;

constexpr uLong method_stored = 0, method_deflated = Z_DEFLATED, flag_encrypted = 1;

[[noreturn]] void refuse_archive(std::string_view why) {
    throw ConfigError(fmt::format("zip archive: {}", why));
}

struct CloseArchive {
    void operator()(unzFile zip) const noexcept { ::unzClose(zip); }
};
using ZipArchive = std::unique_ptr<std::remove_pointer_t<unzFile>, CloseArchive>;

/// File of an archive.
struct ZipEntry {
    std::string name;
    unz_file_info64 facts{};
    unz64_file_pos place{};
};

/// The file at which `zip` stands. Throws ConfigError.
ZipEntry current_entry(unzFile zip) {
    ZipEntry entry;
    const auto read = [&](char* name, std::size_t bytes) {
        return ::unzGetCurrentFileInfo64(zip, &entry.facts, name, bytes, nullptr, 0, nullptr, 0) == UNZ_OK;
    };
    bool good = read(nullptr, 0);
    entry.name.resize(entry.facts.size_filename);
    good = good && read(entry.name.data(), entry.name.size());
    if (!good || ::unzGetFilePos64(zip, &entry.place) != UNZ_OK) refuse_archive("its directory is damaged");
    return entry;
}

/// The only file of the archive whose name ends with .xml; if there is none, its only file.
ZipEntry xml_entry_of(unzFile zip) {
    unz_global_info64 archive{};
    if (::unzGetGlobalInfo64(zip, &archive) != UNZ_OK) refuse_archive("has no directory");
    std::size_t files = 0, xml_files = 0;
    ZipEntry only, xml;
    for (std::uint64_t i = 0; i < archive.number_entry; ++i) {
        if ((i == 0 ? ::unzGoToFirstFile(zip) : ::unzGoToNextFile(zip)) != UNZ_OK)
            refuse_archive("its directory is damaged");
        ZipEntry entry = current_entry(zip);
        if (entry.name.ends_with('/')) continue;
        ++files;
        if (lower_case(entry.name).ends_with(".xml")) {
            ++xml_files;
            xml = std::move(entry);
        } else {
            only = std::move(entry);
        }
    }
    if (xml_files == 1) return xml;
    if (xml_files > 1 || files != 1)
        refuse_archive(fmt::format("holds {} files, {} of them *.xml, wanted is one", files, xml_files));
    return only;
}

/// The XML in an archive. Throws ConfigError.
std::string unzipped_xml(const std::string& file) {
    const ZipArchive zip(::unzOpen64(file.c_str()));
    if (!zip) refuse_archive("has no directory");
    const ZipEntry entry = xml_entry_of(zip.get());
    const unz_file_info64& facts = entry.facts;
    if ((facts.flag & flag_encrypted) != 0) refuse_archive("is encrypted");
    if (facts.compression_method != method_stored && facts.compression_method != method_deflated)
        refuse_archive(fmt::format("compression method {}, allowed are 0 (stored) and 8 (deflated)",
                                   facts.compression_method));
    if (facts.uncompressed_size == 0 || facts.uncompressed_size > xml_bytes_max)
        refuse_archive(fmt::format("{} bytes when unpacked, allowed are 1 to {}", facts.uncompressed_size,
                                   xml_bytes_max));
    if (::unzGoToFilePos64(zip.get(), &entry.place) != UNZ_OK || ::unzOpenCurrentFile(zip.get()) != UNZ_OK)
        refuse_archive("its directory is damaged");
    std::string plain(facts.uncompressed_size, '\0');
    const int bytes = ::unzReadCurrentFile(zip.get(), plain.data(), static_cast<unsigned>(plain.size()));
    // It compares the checksum, too.
    const int state = ::unzCloseCurrentFile(zip.get());
    if (bytes < 0 || static_cast<std::size_t>(bytes) != plain.size() || state != UNZ_OK)
        refuse_archive("its data is damaged");
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
        if (contents.starts_with("PK")) contents = unzipped_xml(file);
        if (const std::string why = make_plain_text(contents); !why.empty()) throw ConfigError(why);
        if (contents.empty()) throw ConfigError("is empty");
        return contents;
    } catch (const ConfigError& e) {
        throw ConfigError(fmt::format("{}: {}", file, e.what()));
    }
}

} // namespace obscura::transports::gige
