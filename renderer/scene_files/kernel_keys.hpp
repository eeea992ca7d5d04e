// SPDX-License-Identifier: Apache-2.0
// Keys of scene files for SPICE kernels: those of the scene, and the frames that they give to its parts.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/kernel_frame.hpp"
#include "renderer/scene_files/scene_epoch.hpp"

#include <memory>
#include <string>
#include <vector>

namespace obscura::scene {

/// Keys of a scene for its date and its kernels. The keys of a file's root are read before its tables, whose
/// checks may therefore use this.
class KernelKeys {
public:
    const std::shared_ptr<SceneEpoch> epoch = std::make_shared<SceneEpoch>();
    std::vector<std::string> files;
    std::string centre = "SOLAR SYSTEM BARYCENTER";

    KernelKeys() = default;
    /// Epoch and kernels of a scene that was read before.
    explicit KernelKeys(const Scene& scene);

    /// The keys, bound to this.
    [[nodiscard]] config::Keys keys();
    /// Reads the kernels at the first call, without `files` the default ephemeris. Throws ConfigError if
    /// there are none. Null: they cannot be used; see check().
    [[nodiscard]] std::shared_ptr<const KernelFrame> frame();
    /// Reports why the kernels cannot be used, and sets epoch, kernels and the path of the Sun of the scene.
    /// `root` is its table.
    void check(Scene& scene, const config::ReadTable& root);

private:
    bool read_ = false;
    bool of_scene_ = false; ///< of a scene that was read before
    std::string key_at_fault_, fault_;
    std::shared_ptr<const KernelFrame> frame_;
};

/// Body of the kernels whose place and axes a part of the scene follows, as keys give it.
struct KernelPlaceKeys {
    std::string body, frame;
};
/// Keys of a body, or of the camera or a lamp, which look somewhere (`looks`).
[[nodiscard]] config::Keys keys_of(KernelPlaceKeys& keys, bool looks);
/// Puts `motion`, as its other keys make it, into the frame that those keys give; without a frame that of the
/// body (`looks`: J2000). Positions of a message count from the body that it names as its centre: without a
/// `parent` (its name, or none) they are put there by the kernels of the scene; about another body than a
/// parent or than that of the keys they are refused. Mistakes are added to the table. Returns whether it
/// follows the kernels.
bool follow_kernels(Motion& motion, const std::string& parent, const KernelPlaceKeys& keys, bool looks,
                    KernelKeys& kernels, const config::ReadTable& table);

} // namespace obscura::scene
