// SPDX-License-Identifier: Apache-2.0
#include "core/io/stop_reading.hpp"

#include <atomic>
#include <utility>

namespace obscura {
namespace {

std::atomic<const StopReading*> current_stop{nullptr};

} // namespace

StopReading::StopReading(std::function<bool()> wanted) : wanted_(std::move(wanted)) {
    current_stop = this;
}

StopReading::~StopReading() {
    current_stop = nullptr;
}

void check_reading() {
    if (const StopReading* const stop = current_stop; stop != nullptr && stop->wanted_())
        throw ReadingStopped();
}

} // namespace obscura
