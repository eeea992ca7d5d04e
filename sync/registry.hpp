// SPDX-License-Identifier: Apache-2.0
// Registry of the kinds of trigger sources.
#pragma once

#include "sync/source_kind.hpp"

#include <memory>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace obscura::sync {

/// One SourceKind of every registered kind, with the values of its keys. Copies are deep.
class SourceKinds {
public:
    /// All kinds with their defaults.
    SourceKinds();
    SourceKinds(const SourceKinds& other);
    SourceKinds(SourceKinds&&) noexcept = default;
    SourceKinds& operator=(SourceKinds other) noexcept;
    ~SourceKinds() = default;

    [[nodiscard]] bool operator==(const SourceKinds& other) const;

    /// All kinds in the order of the registry.
    [[nodiscard]] const std::vector<std::unique_ptr<SourceKind>>& all() const noexcept { return kinds_; }
    /// The kind named `name`; null for an unknown name.
    [[nodiscard]] const SourceKind* find(std::string_view name) const noexcept;
    /// The kind of type `Kind`. Throws std::logic_error when it is not registered.
    template<typename Kind>
    [[nodiscard]] Kind& get() {
        for (const auto& kind : kinds_)
            if (auto* found = dynamic_cast<Kind*>(kind.get())) return *found;
        throw std::logic_error("trigger source not registered");
    }

private:
    std::vector<std::unique_ptr<SourceKind>> kinds_;
};

/// Traits of all kinds, group by group.
[[nodiscard]] const std::vector<const SourceTraits*>& source_traits();

} // namespace obscura::sync
