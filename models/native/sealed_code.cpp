// SPDX-License-Identifier: Apache-2.0
#include "models/native/sealed_code.hpp"

#include "core/io/file_descriptor.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace obscura::models {
namespace {

#ifndef MFD_EXEC
#define MFD_EXEC 0x0010U // Linux 6.3
#endif

/// The file, sealed; empty: `why` says why.
FileDescriptor sealed_file(std::span<const std::uint8_t> code, std::string& why) {
    const auto failed = [&](const char* what) {
        why = fmt::format("{}: {}", what, std::strerror(errno));
        return FileDescriptor();
    };
    // Older kernels do not know MFD_EXEC, and do not need it.
    FileDescriptor file(memfd_create("obscura-model", MFD_CLOEXEC | MFD_ALLOW_SEALING | MFD_EXEC));
    if (file.get() < 0 && errno == EINVAL)
        file = FileDescriptor(memfd_create("obscura-model", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (file.get() < 0) return failed("memfd_create");
    for (std::size_t done = 0; done < code.size();) {
        const ssize_t wrote = write(file.get(), code.data() + done, code.size() - done);
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote <= 0) return failed("write");
        done += static_cast<std::size_t>(wrote);
    }
    if (fcntl(file.get(), F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_GROW | F_SEAL_SHRINK | F_SEAL_SEAL) != 0)
        return failed("F_ADD_SEALS");
    return file;
}

} // namespace

SealedCode::SealedCode(std::span<const std::uint8_t> code, std::string& why) {
    const FileDescriptor file = sealed_file(code, why);
    if (file.get() < 0) return;
    void* const memory = mmap(nullptr, code.size(), PROT_READ | PROT_EXEC, MAP_PRIVATE, file.get(), 0);
    if (memory == MAP_FAILED) {
        why = fmt::format("mmap: {}", std::strerror(errno));
        return;
    }
    memory_ = memory;
    bytes_ = code.size();
}

SealedCode::~SealedCode() {
    if (memory_ != nullptr) munmap(memory_, bytes_);
}

} // namespace obscura::models
