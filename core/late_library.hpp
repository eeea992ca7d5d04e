// Shared libraries that are loaded when they are first called.
#pragma once

#include "core/error.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

namespace obscura {

/// For functions of a library under their own names that hand on to it (images/late_cfitsio.cpp): a program
/// linked with those does not need the library to start, nor what that brings with it. Never unloaded. Any
/// thread, but no real-time one the first time.
class LateLibrary {
public:
    /// `file`: SONAME; `purpose`: what cannot be had without it. Throws HardwareError.
    LateLibrary(const char* file, const char* purpose)
        // Not at global scope: its own calls of these functions must not come to ours.
        : purpose_(purpose), handle_(::dlopen(file, RTLD_NOW | RTLD_LOCAL)) {
        if (handle_ == nullptr) fail();
    }

    /// The library's function of this name; the first argument gives its type.
    template<typename Function>
    [[nodiscard]] Function* find(Function* /*like*/, const char* name) const {
        void* const found = ::dlsym(handle_, name);
        if (found == nullptr) fail();
        return reinterpret_cast<Function*>(found);
    }

private:
    [[noreturn]] void fail() const {
        throw HardwareError(fmt::format("{} cannot be had: {}", purpose_, ::dlerror()));
    }

    const char* purpose_;
    void* handle_;
};

} // namespace obscura
