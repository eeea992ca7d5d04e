// SPDX-License-Identifier: Apache-2.0
#include "serve/render_host.hpp"

#include "serve/scene_calls.hpp"

namespace obscura::serve {
namespace {

class RenderSession final : public service::Session {
public:
    RenderSession(const std::filesystem::path& root, const PictureLimits& limits)
        : limits_(limits), scene_(root), render_(scene_, limits_) {}

    [[nodiscard]] service::Calls calls() override {
        service::Calls all = scene_.calls();
        all.push_back(render_.call());
        return all;
    }
    [[nodiscard]] nlohmann::json description() const override {
        return {{"sections", SceneCalls::sections()}};
    }

private:
    const PictureLimits& limits_;
    SceneCalls scene_;
    RenderCall render_;
};

} // namespace

std::unique_ptr<service::Session> RenderHost::open() {
    return std::make_unique<RenderSession>(root_, limits_);
}

} // namespace obscura::serve
