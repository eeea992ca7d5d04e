// SPDX-License-Identifier: Apache-2.0
// Host of the compatible protocol in `obscura serve`: each published client has a scene of its own.
#pragma once

#include "serve/compatible/client_state.hpp"
#include "service/compatible/limits.hpp"
#include "service/compatible/session.hpp"
#include "service/memory_account.hpp"
#include "service/peer.hpp"

#include <cstddef>
#include <memory>
#include <utility>

namespace obscura::serve::compatible {

/// Opens sessions with an empty scene.
class CompatibleHost final : public service::compatible::Host {
public:
    explicit CompatibleHost(CompatibleSettings settings) : settings_(std::move(settings)) {}

    [[nodiscard]] std::unique_ptr<service::compatible::Session> open(service::MemoryAccount& memory) override;

private:
    const CompatibleSettings settings_;
};

/// The listening endpoint for a server. `clients`: its limit, for the line that one more is sent. `memory`:
/// of the server's clients. `host` and `memory` outlive it.
[[nodiscard]] service::ListeningEndpoint
make_compatible_endpoint(service::Listener listener, service::compatible::Host& host,
                         const service::compatible::CompatibleLimits& limits, service::MemoryAccount& memory,
                         std::size_t clients);

} // namespace obscura::serve::compatible
