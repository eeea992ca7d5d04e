// SPDX-License-Identifier: Apache-2.0
// Opaque client metadata, stored and returned unchanged, within a limit of memory.
#pragma once

#include "service/compatible/value.hpp"

#include <cstddef>
#include <map>
#include <string>

namespace obscura::serve::compatible {

/// Values by name.
class Notes {
public:
    /// Throws Failure (too_large) beyond the limit.
    void set(const std::string& name, const service::compatible::Value& value);
    /// Null: nothing has been set.
    [[nodiscard]] const service::compatible::Value* find(const std::string& name) const;
    [[nodiscard]] service::compatible::Fields all() const;
    void clear();

private:
    struct Note {
        service::compatible::Value value;
        std::size_t bytes = 0;
    };
    std::map<std::string, Note> notes_;
    std::size_t bytes_ = 0;
};

} // namespace obscura::serve::compatible
