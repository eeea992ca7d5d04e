// SPDX-License-Identifier: Apache-2.0
#include "sync/registry.hpp"

#include "sync/sources/gpio.hpp"
#include "sync/sources/lockstep.hpp"
#include "sync/sources/pps.hpp"
#include "sync/sources/ptp.hpp"
#include "sync/sources/ptp_timer.hpp"
#include "sync/sources/timer.hpp"
#include "sync/sources/udp.hpp"

#include <algorithm>

namespace obscura::sync {
namespace {

template<typename Kind>
std::unique_ptr<SourceKind> fresh() {
    return std::make_unique<Kind>();
}

// One line for each kind of source. Their keys are printed in this order.
constexpr std::unique_ptr<SourceKind> (*registry[])() = {
    fresh<TimerKind>,    //
    fresh<GpioKind>,     //
    fresh<PpsKind>,      //
    fresh<PtpKind>,      //
    fresh<PtpTimerKind>, //
    fresh<UdpKind>,      //
    fresh<LockstepKind>, //
};

} // namespace

SourceKinds::SourceKinds() {
    for (const auto make : registry)
        kinds_.push_back(make());
}

SourceKinds::SourceKinds(const SourceKinds& other) {
    for (const auto& kind : other.kinds_)
        kinds_.push_back(kind->clone());
}

SourceKinds& SourceKinds::operator=(SourceKinds other) noexcept {
    kinds_.swap(other.kinds_);
    return *this;
}

bool SourceKinds::operator==(const SourceKinds& other) const {
    return std::equal(kinds_.begin(), kinds_.end(), other.kinds_.begin(), other.kinds_.end(),
                      [](const auto& a, const auto& b) { return a->equals(*b); });
}

const SourceKind* SourceKinds::find(std::string_view name) const noexcept {
    const auto kind =
        std::find_if(kinds_.begin(), kinds_.end(), [&](const auto& k) { return k->traits().name == name; });
    return kind == kinds_.end() ? nullptr : kind->get();
}

const std::vector<const SourceTraits*>& source_traits() {
    static const std::vector<const SourceTraits*> sorted = [] {
        std::vector<const SourceTraits*> traits;
        for (const auto make : registry)
            traits.push_back(&make()->traits());
        std::stable_sort(traits.begin(), traits.end(),
                         [](const SourceTraits* a, const SourceTraits* b) { return a->group < b->group; });
        return traits;
    }();
    return sorted;
}

} // namespace obscura::sync
