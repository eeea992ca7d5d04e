// SPDX-License-Identifier: Apache-2.0
#include "core/io/text_file.hpp"

#include "core/io/file_descriptor.hpp"
#include "core/io/input_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace obscura {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view utf8_mark = "\xEF\xBB\xBF"sv;

} // namespace

std::string_view without_byte_order_mark(std::string_view text) noexcept {
    if (text.starts_with(utf8_mark)) text.remove_prefix(utf8_mark.size());
    return text;
}

std::string make_plain_text(std::string& text) {
    if (text.starts_with("\xFF\xFE"sv) || text.starts_with("\xFE\xFF"sv) ||
        text.starts_with("\0\0\xFE\xFF"sv))
        return "is text in UTF-16 or UTF-32, allowed is UTF-8: save it as such";
    if (text.starts_with(utf8_mark)) text.erase(0, utf8_mark.size());
    while (!text.empty() && (text.back() == '\0' || text.back() == '\x1A'))
        text.pop_back();
    if (const std::size_t nul = text.find('\0'); nul != std::string::npos)
        return fmt::format("has a zero byte at {}: no text file", nul);
    if (text.find('\r') == std::string::npos) return {};
    std::size_t to = 0;
    for (std::size_t from = 0; from < text.size(); ++from) {
        const bool before_lf = text[from] == '\r' && from + 1 < text.size() && text[from + 1] == '\n';
        if (!before_lf) text[to++] = text[from] == '\r' ? '\n' : text[from];
    }
    text.resize(to);
    return {};
}

std::string read_plain_text(const std::filesystem::path& file, std::size_t max_bytes, std::string& text,
                            InputKind kind) {
    errno = 0; // so that a caller may ask for the cause
    // Non-blocking, so that a pipe under this name cannot hold up the start.
    const FileDescriptor in(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
    struct stat facts {};
    if (!in || ::fstat(in.get(), &facts) != 0) return std::strerror(errno);
    // Reading a directory, device or pipe could block or never end.
    if (!S_ISREG(facts.st_mode)) return "not a regular file";
    const auto size = static_cast<std::size_t>(facts.st_size);
    if (size > max_bytes)
        return max_bytes % (1U << 20) == 0 ? fmt::format("larger than {} MiB", max_bytes >> 20)
                                           : fmt::format("larger than {} bytes", max_bytes);
    if (kind == InputKind::scene) note_input(file);
    text.resize(size);
    std::size_t have = 0;
    while (have < size) {
        const ssize_t got = ::read(in.get(), text.data() + have, size - have);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return std::strerror(errno);
        if (got == 0) break;
        have += static_cast<std::size_t>(got);
    }
    text.resize(have);
    return make_plain_text(text);
}

} // namespace obscura
