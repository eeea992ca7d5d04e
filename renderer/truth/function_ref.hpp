// SPDX-License-Identifier: Apache-2.0
// Non-owning reference to a callable, for parameters that are called during the call only.
#pragma once

#include <memory>
#include <type_traits>
#include <utility>

namespace obscura::renderer {

template<typename Signature>
class FunctionRef;

/// Unlike std::function it never allocates. The callable must outlive the reference.
template<typename Result, typename... Arguments>
class FunctionRef<Result(Arguments...)> {
public:
    template<typename Callable>
    requires(!std::is_same_v<Callable, FunctionRef>)
        FunctionRef(const Callable& callable) // NOLINT(google-explicit-constructor): as std::function
        : callable_(std::addressof(callable)), call_([](const void* at, Arguments... arguments) -> Result {
              return (*static_cast<const Callable*>(at))(std::forward<Arguments>(arguments)...);
          }) {}
    Result operator()(Arguments... arguments) const {
        return call_(callable_, std::forward<Arguments>(arguments)...);
    }

private:
    const void* callable_;
    Result (*call_)(const void*, Arguments...);
};

} // namespace obscura::renderer
