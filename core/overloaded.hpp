// SPDX-License-Identifier: Apache-2.0
// Function object of several lambdas, one for each alternative of a std::variant: for std::visit.
#pragma once

namespace obscura {

template<typename... F>
struct Overloaded : F... {
    using F::operator()...;
};
template<typename... F>
Overloaded(F...) -> Overloaded<F...>;

} // namespace obscura
