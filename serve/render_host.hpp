// SPDX-License-Identifier: Apache-2.0
// Host of `obscura serve`: each client has a scene of its own.
#pragma once

#include "serve/render_call.hpp"
#include "service/session.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

namespace obscura::serve {

/// Opens sessions with an empty scene.
class RenderHost final : public service::Host {
public:
    /// `root`: absolute folder below which clients may name files.
    RenderHost(std::string version, std::filesystem::path root, const PictureLimits& limits)
        : version_(std::move(version)), root_(std::move(root)), limits_(limits) {}

    [[nodiscard]] std::string version() const override { return version_; }
    [[nodiscard]] nlohmann::json limits() const override {
        return {{"pixels", limits_.pixels}, {"samples", limits_.samples}};
    }
    [[nodiscard]] std::unique_ptr<service::Session> open() override;

private:
    const std::string version_;
    const std::filesystem::path root_;
    const PictureLimits limits_;
};

} // namespace obscura::serve
