// SPDX-License-Identifier: Apache-2.0
// Call `render`: the picture of a client's scene as arrays, of light or of digital numbers.
#pragma once

#include "renderer/renderer.hpp"
#include "serve/detector_pictures.hpp"
#include "serve/scene_calls.hpp"
#include "service/array.hpp"
#include "service/call.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace obscura::serve {

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
    /// Rolling shutter of pictures without a sensor: time from the beginning of the exposure of a row of the
    /// picture to that of the next; the time that a call gives is that of the first one. 0: all at once.
    void set_line_time(std::int64_t ns) noexcept { line_ns_ = ns; }
    /// Pictures without a sensor are so many lines of the one row of the scene's camera, each at its time;
    /// empty: pictures of its pixels. Must outlive the calls.
    void set_lines(std::span<const RowTime> times) noexcept { lines_ = times; }
    /// The renderer of the scene as it is now, made with the settings of the picture before. Throws Failure.
    [[nodiscard]] const renderer::Renderer& current();

private:
    struct Arguments;
    struct Made;
    struct Rows;

    [[nodiscard]] service::Answer run(const Arguments& arguments, service::Work& work);
    /// The scene's camera with the pixels that the request wants.
    [[nodiscard]] scene::Camera camera(const Arguments& arguments);
    [[nodiscard]] const renderer::Renderer& renderer(const Arguments& arguments, const scene::Camera& camera);
    [[nodiscard]] static service::Array light(const renderer::Renderer& renderer, const Rows& rows,
                                              service::Work& work);
    static void add_layers(const renderer::Renderer& renderer, Rows rows,
                           const std::vector<std::size_t>& aovs, std::vector<service::Array>& arrays,
                           service::Work& work);

    const SceneCalls& scene_;
    const PictureLimits& limits_;
    DetectorPictures detector_;
    const std::shared_ptr<renderer::ShapeCache> shapes_ = renderer::make_shape_cache();
    std::unique_ptr<Made> made_;
    std::int64_t line_ns_ = 0;
    std::span<const RowTime> lines_;
};

} // namespace obscura::serve
