// SPDX-License-Identifier: Apache-2.0
// Call `render`: the picture of a client's scene as arrays.
#pragma once

#include "renderer/renderer.hpp"
#include "service/call.hpp"
#include "tools/serve/scene_calls.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>

namespace obscura::tools {

/// Limits of a picture.
struct PictureLimits {
    std::uint64_t pixels = std::uint64_t{16384} * 16384;
    std::uint32_t samples = 65536;
    std::uint32_t threads = 0; ///< for one picture; 0: one per core
};

/// Makes the pictures of one client; keeps the renderer of the scene last seen. Thread-bound.
class RenderCall {
public:
    /// Both outlive this.
    RenderCall(const SceneCalls& scene, const PictureLimits& limits);
    ~RenderCall();
    RenderCall(const RenderCall&) = delete;
    RenderCall& operator=(const RenderCall&) = delete;

    [[nodiscard]] service::Call call();

private:
    struct Arguments;
    struct Made;

    [[nodiscard]] service::Answer run(const Arguments& arguments, service::Work& work);
    [[nodiscard]] const renderer::Renderer& renderer(const Arguments& arguments);

    const SceneCalls& scene_;
    const PictureLimits& limits_;
    const std::shared_ptr<renderer::ShapeCache> shapes_ = renderer::make_shape_cache();
    std::unique_ptr<Made> made_;
};

} // namespace obscura::tools
