// SPDX-License-Identifier: Apache-2.0
// Bytes of a giant texture over its shards on disk: FILE, FILE.001, FILE.002 and so on.
#pragma once

#include "core/io/file_descriptor.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace obscura::terrain::obt {

/// No file has more.
inline constexpr std::uint64_t max_shards = 4096;
/// `file` for 0, then `file`.001 and so on.
[[nodiscard]] std::filesystem::path shard_path(const std::filesystem::path& file, std::uint64_t number);
/// Shards of that many bytes, at least 1.
[[nodiscard]] std::uint64_t shards_of(std::uint64_t file_bytes, std::uint64_t shard_bytes);

/// A finished file, read by pread. Immutable once all shards are open; thread-safe.
class InputShards {
public:
    /// Opens the first shard. Throws InputError.
    explicit InputShards(const std::filesystem::path& file);
    /// Opens the others and checks the sizes of all. Throws InputError.
    void open_all(std::uint64_t file_bytes, std::uint64_t shard_bytes);
    /// Fills `out` from byte `place` on. Throws InputError.
    void read(std::uint64_t place, std::span<std::byte> out) const;
    [[nodiscard]] const std::string& name() const { return name_; }

private:
    std::filesystem::path file_;
    std::string name_;
    std::vector<FileDescriptor> shards_;
    std::uint64_t shard_bytes_ = ~std::uint64_t{0};
};

/// A file that is being written, as `file`.part, `file`.part.001 and so on. Thread-bound.
class OutputShards {
public:
    /// Opens or creates the first part and locks it. Throws OutputError.
    OutputShards(const std::filesystem::path& file, std::uint64_t shard_bytes);

    /// What is there from byte `place` on, zeros where nothing is. Throws OutputError.
    void read(std::uint64_t place, std::span<std::byte> out);
    /// Throws OutputError, for example if the disk is full. Thread-safe with itself, of other bytes.
    void write(std::uint64_t place, std::span<const std::byte> bytes);
    /// Has the system begin with bringing to disk what was written.
    void start_writeback() noexcept;
    /// Removes all that was written; the first part stays, empty.
    void clear();
    /// Sets the length, writes all to disk and gives the shards their names, the first one last. `header` is
    /// written in between. Throws OutputError.
    void finish(std::uint64_t file_bytes, std::span<const std::byte> header);
    /// Removes the parts.
    void remove() noexcept;

private:
    [[nodiscard]] int shard(std::uint64_t number);
    [[noreturn]] void fail(const std::string& what) const;

    std::filesystem::path file_, part_;
    std::uint64_t shard_bytes_;
    std::mutex opening_;
    std::vector<FileDescriptor> shards_;
};

} // namespace obscura::terrain::obt
