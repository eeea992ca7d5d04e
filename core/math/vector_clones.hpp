// SPDX-License-Identifier: Apache-2.0
// Hot loops compiled for several instruction sets.
#pragma once

/// Compiles a hot loop for several instruction sets, selected at start-up. All give the same results: IEEE
/// operations only, no contraction (-ffp-contract=off). Off under sanitizers, whose runtime is not ready yet
/// when the loader resolves the selection.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(OBSCURA_SANITIZED)
#define OBSCURA_VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define OBSCURA_VECTOR_CLONES
#endif
