// SPDX-License-Identifier: Apache-2.0
// Shared libraries loaded by dlopen at the first call.
#pragma once

#include "core/error.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

namespace obscura {

/// Loader behind stub functions, which have the names of the library's functions and forward to them
/// (images/late_cfitsio.cpp): a program linked with the stubs starts without the library and its
/// dependencies. Never unloaded. Thread-safe; the first call of a stub is not real-time safe.
class LateLibrary {
public:
    /// Loads the library with SONAME `file`; `purpose` names in messages what needs it. Throws HardwareError.
    LateLibrary(const char* file, const char* purpose)
        // RTLD_LOCAL: calls inside the library must resolve to its own functions, not to the stubs.
        : purpose_(purpose), handle_(::dlopen(file, RTLD_NOW | RTLD_LOCAL)) {
        if (handle_ == nullptr) fail();
    }

    /// The library's function `name`; the first argument gives its type.
    template<typename Function>
    [[nodiscard]] Function* find(Function* /*like*/, const char* name) const {
        void* const found = ::dlsym(handle_, name);
        if (found == nullptr) fail();
        return reinterpret_cast<Function*>(found);
    }

private:
    [[noreturn]] void fail() const {
        throw HardwareError(fmt::format("{}: library not available: {}", purpose_, ::dlerror()));
    }

    const char* purpose_;
    void* handle_;
};

} // namespace obscura
