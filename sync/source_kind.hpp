// SPDX-License-Identifier: Apache-2.0
// Interface of a kind of trigger source: its configuration keys, their checks, and its factory.
#pragma once

#include "config/keys.hpp"
#include "core/camera/trigger.hpp"
#include "core/clock.hpp"
#include "core/realtime/realtime.hpp"
#include "sync/sync.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

namespace obscura::sync {

struct EdgeTriggerSettings;
struct TriggerLineSettings;

/// Origin of a source's edges. Names of sources are listed group by group.
enum class SourceGroup : std::uint8_t {
    schedule,  ///< instants that the source computes itself
    input,     ///< edges received from a line, device or socket
    simulator, ///< steps of a simulator; for Line0 only
};

/// Static description of a kind of source.
struct SourceTraits {
    std::string_view name; ///< value of the key `source`
    std::string_view help; ///< what it delivers, as a noun phrase for the help of `source`
    SourceGroup group = SourceGroup::input;
    /// Edges follow rate_hz and phase_ms; else rate_hz is the nominal rate only.
    bool uses_rate = false;
    /// Node opened while the key `device` is empty; empty: no device is opened.
    std::string_view device{};
};

/// Callback that reports an invalid value of a key of the line's table.
using Refuse = std::function<void(std::string_view key, std::string_view what)>;

/// A kind of trigger source with the values of the keys that only this kind has. Its defaults are those of
/// the configuration. Not thread-safe; used at set-up only.
class SourceKind {
public:
    virtual ~SourceKind() = default;

    [[nodiscard]] virtual const SourceTraits& traits() const noexcept = 0;
    /// Keys that only this kind has, bound to this object. Names are unique among all kinds.
    [[nodiscard]] virtual config::Keys keys() { return {}; }
    /// Reports values that make() or start() would refuse; opens nothing. Called for the line's chosen source
    /// only.
    virtual void check(const TriggerLineSettings& /*line*/, const Refuse& /*refuse*/) const {}
    /// Edge types that the source can report. Single-edge sources report rising edges.
    [[nodiscard]] virtual LineEdges edges() const { return {.rising = true}; }
    /// Makes a source, not started, from settings that passed check(). `clock` must outlive it.
    [[nodiscard]] virtual std::unique_ptr<TriggerSource>
    make(const TriggerLineSettings& line, const Clock& clock, const ThreadSettings& thread) const = 0;

    [[nodiscard]] virtual std::unique_ptr<SourceKind> clone() const = 0;
    /// Whether `other`, of the same kind, has the same values.
    [[nodiscard]] virtual bool equals(const SourceKind& other) const = 0;

protected:
    SourceKind() = default;
    SourceKind(const SourceKind&) = default;
    SourceKind& operator=(const SourceKind&) = default;
};

/// Base of every kind: copies and compares by the members of `Kind`, which has a constant
/// `SourceTraits description` and a defaulted operator==.
template<typename Kind>
class SourceKindOf : public SourceKind {
public:
    [[nodiscard]] const SourceTraits& traits() const noexcept final { return Kind::description; }
    [[nodiscard]] std::unique_ptr<SourceKind> clone() const final {
        return std::make_unique<Kind>(static_cast<const Kind&>(*this));
    }
    [[nodiscard]] bool equals(const SourceKind& other) const final {
        const auto* same = dynamic_cast<const Kind*>(&other);
        return same != nullptr && static_cast<const Kind&>(*this) == *same;
    }
    // No members to compare here; those of `Kind` are compared there.
    constexpr bool operator==(const SourceKindOf& /*other*/) const noexcept { return true; }
};

/// Settings of an EdgeTrigger (sync/edge_trigger.hpp) for `line`: its nominal period is 1/rate_hz.
[[nodiscard]] EdgeTriggerSettings edge_trigger_settings(const TriggerLineSettings& line,
                                                        const ThreadSettings& thread);

} // namespace obscura::sync
