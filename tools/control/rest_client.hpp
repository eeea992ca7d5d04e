// SPDX-License-Identifier: Apache-2.0
// Requests to the REST interface of an obscura-web, and its refusals as errors.
#pragma once

#include "host/daemon_calls.hpp"
#include "tools/control/http_calls.hpp"
#include "tools/control/http_client.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// Thread-bound. `verb` stands in front of messages. Members throw HardwareError, CallError, Interrupted.
class RestClient {
public:
    /// Asks nothing yet. Throws UsageError, HardwareError.
    RestClient(std::string_view verb, const HttpOptions& options);

    /// Name of the call in progress, which messages of the daemon begin with.
    void set_call(std::string_view name) { call_ = name; }

    [[nodiscard]] host::CallJson get(const std::string& path);
    [[nodiscard]] host::CallJson ask(std::string_view method, const std::string& path,
                                     const host::CallJson& body);
    /// The answer as it came, of status 200 to 299.
    [[nodiscard]] HttpAnswer get_bytes(const std::string& path);
    [[nodiscard]] host::CallJson parsed(const HttpAnswer& answer) const;

    /// What the daemons behind the server do, as their call `state` tells it; one at least.
    [[nodiscard]] std::vector<host::CallJson> states();
    /// Lines of their logs with numbers above `after`, oldest first.
    [[nodiscard]] std::vector<host::CallJson> events(std::uint64_t after);

private:
    [[nodiscard]] HttpAnswer checked(HttpAnswer answer) const;

    const std::string verb_;
    std::string call_;
    HttpClient client_;
};

} // namespace obscura::tools
