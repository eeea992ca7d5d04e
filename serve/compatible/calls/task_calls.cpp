// SPDX-License-Identifier: Apache-2.0
// Commands that render a picture in parts.
#include "serve/compatible/client_state.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/micro_tasks.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>

namespace obscura::serve::compatible {
namespace {

/// A client's message holds 4 million values, a task has 10.
constexpr std::int64_t max_tasks = 400'000;

void generate(const ClientState& client_state, Reply& reply) {
    const CameraSettings& camera = client_state.camera;
    const std::int64_t pixels = std::int64_t{camera.width} * camera.height;
    if (pixels > max_tasks)
        throw service::Failure(service::FailureCode::too_large,
                               fmt::format("generateMicroTasks: {} x {} pixels, allowed {} in all",
                                           camera.width, camera.height, max_tasks));
    // Ten values a task, and their encoding.
    reply.share = client_state.hold(static_cast<std::uint64_t>(pixels) * 10 * 3 * sizeof(Value));
    reply.set("utasks",
              micro_tasks(camera.width, camera.height, client_state.rendering.samples, camera.integration_s));
}

} // namespace

void add_task_calls(Handlers& handlers) {
    handlers["generateMicroTasks"] = [](Request& r) { generate(r.client_state, r.reply); };
    handlers["renderMicroTasks"] = [](Request& r) {
        const std::vector<float> weights = weights_of(
            r.arguments.value("utasks"), r.client_state.camera.width, r.client_state.camera.height);
        r.client_state.render(windows_of(weights, r.client_state.camera.width), r.work);
        Picture& picture = *r.client_state.picture;
        for (std::size_t i = 0; i < picture.values.size(); ++i)
            picture.values[i] *= weights[i % weights.size()];
    };
}

} // namespace obscura::serve::compatible
