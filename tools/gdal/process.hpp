// SPDX-License-Identifier: Apache-2.0
// Helper process obscura-gdal as seen from obscura: maps of many formats, read block by block.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "tools/gdal/protocol.hpp"

#include <chrono>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace obscura::tools {

/// What one helper may take.
struct GdalLimits {
    std::chrono::milliseconds answer{120'000};           ///< until a request is answered
    std::uint64_t memory_bytes = std::uint64_t{4} << 30; ///< of addresses
};

/// The program: of the environment variable OBSCURA_GDAL, beside this program, in libexec. Empty: there is
/// none.
[[nodiscard]] std::filesystem::path gdal_helper();

/// GDAL is not written for hostile files: it runs in a process of its own, and any fault there (crash, no
/// memory, no end) is an InputError with one line here. Thread-bound.
class GdalProcess {
public:
    /// Starts the helper. Throws Error if it is not installed or cannot be started.
    explicit GdalProcess(const GdalLimits& limits = {});
    ~GdalProcess();
    GdalProcess(const GdalProcess&) = delete;
    GdalProcess& operator=(const GdalProcess&) = delete;

    /// All throw InputError `file: why`.
    [[nodiscard]] GdalMap open(const std::filesystem::path& file);
    /// Samples of a block of a band with that type, in the type of the file, rows * columns. The bytes are
    /// valid until the next request.
    [[nodiscard]] std::span<const std::byte> read(const GdalBlock& block, GdalType type);
    /// x and y of points given by longitude and latitude in degrees; NaN where there are none.
    [[nodiscard]] std::vector<std::array<double, 2>> transform(const GdalTransform& transform);

    /// False once it has failed.
    [[nodiscard]] bool running() const { return pid_ > 0; }
    [[nodiscard]] int pid() const { return pid_; }

private:
    std::span<const std::byte> ask(GdalMessage request, std::string_view body, GdalMessage wanted,
                                   const std::string& name);
    void send(std::string_view bytes, const std::string& name);
    void receive(void* to, std::size_t bytes, const std::string& name);
    void wait(int fd, short events, const std::string& name);
    [[noreturn]] void lost(const std::string& name);
    void stop();
    [[nodiscard]] std::string name_of_file(std::uint32_t id) const;

    GdalLimits limits_;
    int pid_ = -1;
    FileDescriptor to_, from_;
    std::chrono::steady_clock::time_point deadline_;
    std::vector<std::byte> body_;
    std::vector<std::string> names_; ///< of the files, by number
};

} // namespace obscura::tools
