// SPDX-License-Identifier: Apache-2.0
// Reading of kernel files of any kind in order of priority, with those that meta-kernels name.
#pragma once

#include "ephemeris/kernels/daf.hpp"
#include "ephemeris/kernels/kernel_pool.hpp"

#include <filesystem>
#include <vector>

namespace obscura::ephemeris {

/// Content of the loaded files.
struct KernelFiles {
    KernelPool pool;
    std::vector<Daf> dafs; ///< in order of loading
};

/// Reads `files` and what meta-kernels among them name. Throws InputError, also if meta-kernels name each
/// other.
[[nodiscard]] KernelFiles read_kernels(const std::vector<std::filesystem::path>& files);

} // namespace obscura::ephemeris
