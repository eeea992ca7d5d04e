// SPDX-License-Identifier: Apache-2.0
#include "terrain/obt/obt_storage.hpp"

#include "core/error.hpp"
#include "core/io/input_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace obscura::terrain::obt {
namespace {

std::string error_text(int error) {
    return std::generic_category().message(error);
}

/// Calls `use(shard, place in it, bytes)` for the pieces of a range.
template<typename Use>
void for_each_piece(std::uint64_t place, std::size_t size, std::uint64_t shard_bytes, const Use& use) {
    for (std::size_t done = 0; done < size;) {
        const std::uint64_t at = place + done;
        const auto piece =
            static_cast<std::size_t>(std::min<std::uint64_t>(size - done, shard_bytes - at % shard_bytes));
        use(at / shard_bytes, at % shard_bytes, done, piece);
        done += piece;
    }
}

/// Bytes read: fewer than asked for at the end of the file; -1: errno.
ssize_t read_all(int fd, std::byte* out, std::size_t size, std::uint64_t place) {
    std::size_t done = 0;
    while (done < size) {
        const ssize_t n = ::pread(fd, out + done, size - done, static_cast<off_t>(place + done));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return -1;
        if (n == 0) break;
        done += static_cast<std::size_t>(n);
    }
    return static_cast<ssize_t>(done);
}

} // namespace

std::filesystem::path shard_path(const std::filesystem::path& file, std::uint64_t number) {
    return number == 0 ? file : std::filesystem::path(file.string() + fmt::format(".{:03}", number));
}

std::uint64_t shards_of(std::uint64_t file_bytes, std::uint64_t shard_bytes) {
    return std::max<std::uint64_t>(1, (file_bytes + shard_bytes - 1) / shard_bytes);
}

InputShards::InputShards(const std::filesystem::path& file) : file_(file), name_(file.string()) {
    require_regular_file(file);
    shards_.emplace_back(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
    if (!shards_[0]) throw InputError(fmt::format("{}: cannot open: {}", name_, error_text(errno)), errno);
}

void InputShards::open_all(std::uint64_t file_bytes, std::uint64_t shard_bytes) {
    const std::uint64_t count = shards_of(file_bytes, shard_bytes);
    if (count > max_shards)
        throw InputError(fmt::format("{}: {} parts: allowed are at most {}", name_, count, max_shards));
    shard_bytes_ = shard_bytes;
    for (std::uint64_t k = 0; k < count; ++k) {
        const std::filesystem::path path = shard_path(file_, k);
        if (k > 0) {
            require_regular_file(path);
            shards_.emplace_back(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
        }
        struct stat status {};
        if (!shards_[k] || ::fstat(shards_[k].get(), &status) != 0)
            throw InputError(fmt::format("{}: cannot open: {}", path.string(), error_text(errno)), errno);
        const std::uint64_t stated = std::min(shard_bytes, file_bytes - k * shard_bytes);
        if (static_cast<std::uint64_t>(status.st_size) != stated)
            throw InputError(
                fmt::format("{}: {} bytes, where the header of the texture states {}: it is not whole",
                            path.string(), status.st_size, stated));
    }
}

void InputShards::read(std::uint64_t place, std::span<std::byte> out) const {
    for_each_piece(
        place, out.size(), shard_bytes_,
        [&](std::uint64_t shard, std::uint64_t at, std::size_t done, std::size_t piece) {
            if (shard >= shards_.size())
                throw InputError(fmt::format("{}: ends before byte {}", name_, place));
            const ssize_t n = read_all(shards_[shard].get(), out.data() + done, piece, at);
            if (n < 0)
                throw InputError(
                    fmt::format("{}: cannot read at byte {}: {}", name_, place, error_text(errno)), errno);
            if (static_cast<std::size_t>(n) < piece)
                throw InputError(fmt::format("{}: ends before byte {}", name_, place + out.size()));
        });
}

OutputShards::OutputShards(const std::filesystem::path& file, std::uint64_t shard_bytes)
    : file_(file), part_(file.string() + ".part"), shard_bytes_(shard_bytes) {
    const int first = shard(0);
    if (::flock(first, LOCK_EX | LOCK_NB) != 0)
        throw OutputError(fmt::format("{}: another process is writing it", part_.string()));
}

void OutputShards::fail(const std::string& what) const {
    throw OutputError(fmt::format("{}: cannot {}: {}", file_.string(), what, error_text(errno)), errno);
}

int OutputShards::shard(std::uint64_t number) {
    if (number >= max_shards)
        throw OutputError(
            fmt::format("{}: more than {} parts of {} bytes", file_.string(), max_shards, shard_bytes_));
    const std::lock_guard lock(opening_);
    while (shards_.size() <= number) {
        const std::filesystem::path path = shard_path(part_, shards_.size());
        FileDescriptor fd(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666));
        struct stat status {};
        if (!fd || ::fstat(fd.get(), &status) != 0) fail("write " + path.string());
        if (!S_ISREG(status.st_mode)) throw OutputError(fmt::format("{}: not a regular file", path.string()));
        shards_.push_back(std::move(fd));
    }
    return shards_[number].get();
}

void OutputShards::read(std::uint64_t place, std::span<std::byte> out) {
    for_each_piece(place, out.size(), shard_bytes_,
                   [&](std::uint64_t number, std::uint64_t at, std::size_t done, std::size_t piece) {
                       const ssize_t n = read_all(shard(number), out.data() + done, piece, at);
                       if (n < 0) fail(fmt::format("read at byte {}", place));
                       std::fill(out.begin() + static_cast<std::ptrdiff_t>(done) + n,
                                 out.begin() + static_cast<std::ptrdiff_t>(done + piece), std::byte{0});
                   });
}

void OutputShards::write(std::uint64_t place, std::span<const std::byte> bytes) {
    for_each_piece(place, bytes.size(), shard_bytes_,
                   [&](std::uint64_t number, std::uint64_t at, std::size_t done, std::size_t piece) {
                       const int fd = shard(number);
                       for (std::size_t k = 0; k < piece;) {
                           const ssize_t n =
                               ::pwrite(fd, bytes.data() + done + k, piece - k, static_cast<off_t>(at + k));
                           if (n < 0 && errno == EINTR) continue;
                           if (n <= 0) fail("write");
                           k += static_cast<std::size_t>(n);
                       }
                   });
}

void OutputShards::start_writeback() noexcept {
    for (const FileDescriptor& fd : shards_)
        (void)::sync_file_range(fd.get(), 0, 0, SYNC_FILE_RANGE_WRITE);
}

void OutputShards::clear() {
    std::error_code ignored;
    for (std::uint64_t k = 1; k < max_shards; ++k)
        if (!std::filesystem::remove(shard_path(part_, k), ignored)) break;
    shards_.resize(1);
    if (::ftruncate(shards_[0].get(), 0) != 0) fail("write");
}

void OutputShards::finish(std::uint64_t file_bytes, std::span<const std::byte> header) {
    const std::uint64_t count = shards_of(file_bytes, shard_bytes_);
    for (std::uint64_t k = 0; k < count; ++k)
        if (::ftruncate(shard(k),
                        static_cast<off_t>(std::min(shard_bytes_, file_bytes - k * shard_bytes_))) != 0)
            fail("write");
    // The header that calls the file complete must not reach the disk before the rest.
    for (const FileDescriptor& fd : shards_)
        if (::fdatasync(fd.get()) != 0) fail("write");
    write(0, header);
    if (::fsync(shards_[0].get()) != 0) fail("write");
    for (std::uint64_t k = count; k-- > 0;)
        if (::rename(shard_path(part_, k).c_str(), shard_path(file_, k).c_str()) != 0)
            fail("rename the parts");
    const std::filesystem::path folder = file_.has_parent_path() ? file_.parent_path() : ".";
    if (const FileDescriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)); fd)
        (void)::fsync(fd.get());
}

void OutputShards::remove() noexcept {
    std::error_code ignored;
    for (std::uint64_t k = 0; k < max_shards; ++k)
        if (!std::filesystem::remove(shard_path(part_, k), ignored)) break;
}

} // namespace obscura::terrain::obt
