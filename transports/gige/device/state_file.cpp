// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/state_file.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "core/io/temporary_name.hpp"
#include "transports/gige/registers/register_bank.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <optional>

namespace obscura::transports::gige {
namespace {

constexpr std::int64_t format_version = 2;
/// Version 1 had exposure times in units of 10 ns, not of 1 us.
constexpr std::uint32_t words_per_us_of_version_1 = 100;
/// Several times what all registers of a device need.
constexpr std::size_t largest_file = 64 * 1024;
constexpr std::string_view checksum_begin = "checksum = \"";
constexpr std::string_view not_ours = "not a state file of this version";

std::string checksum_line(std::string_view text) {
    const auto sum = crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
    return fmt::format("{}{:08x}\"\n", checksum_begin, sum);
}

std::optional<std::uint32_t> word_of(const config::Value* value) {
    if (value == nullptr || value->kind != config::Value::Kind::integer || value->integer < 0 ||
        value->integer > std::numeric_limits<std::uint32_t>::max())
        return std::nullopt;
    return static_cast<std::uint32_t>(value->integer);
}

const config::Value* value_of(const config::Value& table, std::string_view key) {
    const config::Member* member = table.find(key);
    return member == nullptr ? nullptr : &member->value;
}

bool parse_words(const config::Value* list, std::vector<SavedWord>& words) {
    if (list == nullptr || list->kind != config::Value::Kind::array) return false;
    for (const config::Value& pair : list->items) {
        if (pair.kind != config::Value::Kind::array || pair.items.size() != 2) return false;
        const auto address = word_of(&pair.items[0]), word = word_of(&pair.items[1]);
        if (!address || !word) return false;
        words.push_back({*address, *word});
    }
    return true;
}

/// Whether the register holds an exposure time: ExposureTime, or RegionExposureTime of one of 64 regions.
bool holds_exposure_time(std::uint32_t address) {
    return address == 0xA150 || (address >= 0xB014 && address < 0xC000 && (address - 0xB014) % 64 == 0);
}

std::string parse_state(std::string_view text, DeviceState& state) {
    // The checksum comes first: a file that has changed is not parsed.
    const std::size_t last_line = text.rfind(checksum_begin);
    if (last_line == std::string_view::npos || last_line == 0 || text[last_line - 1] != '\n')
        return std::string(not_ours);
    if (text.substr(last_line) != checksum_line(text.substr(0, last_line)))
        return "damaged or changed by hand: its checksum does not match";
    DeviceState read;
    try {
        const config::Value table = config::parse_text(text, "state");
        const auto version = word_of(value_of(table, "version"));
        const config::Value* const user_id = value_of(table, "device_user_id");
        const auto user_set_default = word_of(value_of(table, "user_set_default"));
        if (!version || *version < 1 || *version > format_version || user_id == nullptr ||
            user_id->kind != config::Value::Kind::string || !is_register_text(user_id->string) ||
            !user_set_default || !parse_words(value_of(table, "user_set_1"), read.user_set_1))
            return std::string(not_ours);
        if (*version == 1)
            for (SavedWord& saved : read.user_set_1)
                if (holds_exposure_time(saved.address))
                    saved.word = std::max(1U, saved.word / words_per_us_of_version_1);
        read.user_id = user_id->string;
        read.user_set_default = *user_set_default;
    } catch (const Error&) {
        return std::string(not_ours);
    }
    state = std::move(read);
    return {};
}

// Why the last system call failed.
std::string cause() {
    return std::strerror(errno);
}

bool write_all(int fd, std::string_view text) {
    while (!text.empty()) {
        const ssize_t n = ::write(fd, text.data(), text.size());
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return false;
        text.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
}

} // namespace

std::string format_state(const DeviceState& state) {
    std::string escaped;
    for (const char c : state.user_id) {
        if (c == '"' || c == '\\') escaped += '\\';
        escaped += c;
    }
    std::string text = fmt::format("# State of a GigE Vision camera of Obscura, written by obscurad: "
                                   "DeviceUserID and user sets.\n"
                                   "# Not read any more once it is changed by hand.\n"
                                   "version = {}\n"
                                   "device_user_id = \"{}\"\n"
                                   "user_set_default = {}\n"
                                   "user_set_1 = [ # register, word\n",
                                   format_version, escaped, state.user_set_default);
    for (const SavedWord& saved : state.user_set_1)
        text += fmt::format("    [{:#x}, {:#x}],\n", saved.address, saved.word);
    text += "]\n";
    return text + checksum_line(text);
}

std::string read_state(const std::string& file, DeviceState& state) {
    // Non-blocking, so that a FIFO under this name cannot hold up the start.
    const FileDescriptor fd(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
    if (fd.get() < 0) {
        if (errno != ENOENT) return "cannot be read: " + cause();
        state = {};
        return {};
    }
    struct stat about {};
    if (fstat(fd.get(), &about) != 0) return "cannot be read: " + cause();
    if (!S_ISREG(about.st_mode)) return "not a regular file";
    std::string text(largest_file + 1, '\0');
    std::size_t bytes = 0;
    while (bytes < text.size()) {
        const ssize_t n = ::read(fd.get(), text.data() + bytes, text.size() - bytes);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return "cannot be read: " + cause();
        if (n == 0) break;
        bytes += static_cast<std::size_t>(n);
    }
    if (bytes > largest_file) return fmt::format("larger than {} bytes, no state file", largest_file);
    text.resize(bytes);
    return parse_state(text, state);
}

std::string write_state(const std::string& file, const DeviceState& state) {
    // Written beside and renamed: the file holds the old state or the new one, whenever the power fails.
    // Created exclusively, so that a link planted under the name is not followed.
    const std::string beside = temporary_beside(file).string();
    constexpr mode_t owner_and_group = 0640;
    const FileDescriptor fd(::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, owner_and_group));
    if (fd.get() < 0) return "cannot be written: " + cause();
    if (fchmod(fd.get(), owner_and_group) != 0 || !write_all(fd.get(), format_state(state)) ||
        fsync(fd.get()) != 0 || std::rename(beside.c_str(), file.c_str()) != 0) {
        const std::string why = "cannot be written: " + cause();
        unlink(beside.c_str());
        return why;
    }
    return {};
}

} // namespace obscura::transports::gige
