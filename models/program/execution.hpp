// SPDX-License-Identifier: Apache-2.0
// How programs of models are made, and what an evaluation may cost.
#pragma once

#include "models/native/native_code.hpp"

#include <functional>

namespace obscura::models {

/// Instruction set, allowed cost and thread of the programs of a model. A null `aside` makes them here.
struct Execution {
    Execution() = default;
    Execution(NativeTarget the_target) : target(the_target) {} // NOLINT(google-explicit-constructor)

    /// Machine code is made for this, or none: the interpreter. Both give the same bits.
    NativeTarget target = native_target();
    /// Largest cost of an evaluation on this machine, ns of processor time; 0: any, and nothing is measured.
    double max_ns = 0;
    /// Runs work on another thread and waits for it, for callers whose own has better to do; rethrows what
    /// it throws. Null: here.
    std::function<void(const std::function<void()>& work)> aside{};

    void make(const std::function<void()>& work) const { aside ? aside(work) : work(); }
};

} // namespace obscura::models
