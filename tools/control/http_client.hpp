// SPDX-License-Identifier: Apache-2.0
// HTTP client over libcurl, which is loaded at the first use.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace obscura::tools {

struct HttpAnswer {
    long status = 0;
    std::string body;
    std::map<std::string, std::string> headers{}; ///< names in lower case
};

/// Requests to one server, over a connection that is kept. Follows no redirection, uses no proxy, verifies
/// certificates and names. Thread-bound.
class HttpClient {
public:
    /// Largest answer: a raw frame of 16,384 x 16,384 pixels.
    static constexpr std::size_t max_bytes = 1ULL << 29;

    /// `verb` stands in front of messages. `url` begins with http:// or https://. `authority`: file of
    /// trusted certificates; empty: those of the system. Throws UsageError for another URL, HardwareError
    /// without the library.
    HttpClient(std::string_view verb, std::string url, std::string token, const std::string& authority,
               double timeout_s);
    ~HttpClient();
    HttpClient(const HttpClient&) = delete;
    HttpClient& operator=(const HttpClient&) = delete;

    /// `path` begins with a slash; `body`: JSON, sent with methods other than GET. Throws HardwareError if no
    /// answer comes, Interrupted.
    [[nodiscard]] HttpAnswer ask(std::string_view method, const std::string& path,
                                 const std::string& body = {});

private:
    struct Library;
    std::string verb_, url_, token_;
    void* handle_;
};

} // namespace obscura::tools
