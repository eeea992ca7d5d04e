// SPDX-License-Identifier: Apache-2.0
// A GigE camera before a camera made of numbers, from construction to destruction.
#pragma once

#include "core/clock.hpp"
#include "tests/support/pattern_camera.hpp"
#include "transports/gige/gige.hpp"

#include <utility>

namespace obscura::test {

struct GigeBench {
    MonotonicClock clock;
    PatternCamera source;
    transports::gige::GigeCamera camera;

    GigeBench(const CameraLimits& limits, transports::gige::GigeSettings settings,
              transports::gige::GigeContext context = {})
        : source(limits, 24), camera(std::move(settings), source, clock, std::move(context)) {
        source.set_transport(camera);
        camera.start();
    }
    ~GigeBench() {
        source.acquisition_stop(true);
        camera.stop();
    }
    GigeBench(const GigeBench&) = delete;
    GigeBench& operator=(const GigeBench&) = delete;
};

} // namespace obscura::test
