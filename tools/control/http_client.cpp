// SPDX-License-Identifier: Apache-2.0
#include "tools/control/http_client.hpp"

#include "core/io/late_library.hpp"
#include "host/command_line.hpp"
#include "host/daemon_calls.hpp"
#include "host/interrupt.hpp"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

// Options are checked by the library at run time; its macros would hide the pointers to its functions.
#undef curl_easy_setopt
#undef curl_easy_getinfo

namespace obscura::tools {

/// Functions of libcurl. Linked, it would cost every verb the loading of its libraries.
struct HttpClient::Library {
    LateLibrary file;
    decltype(&::curl_easy_init) init;
    decltype(&::curl_easy_setopt) set;
    decltype(&::curl_easy_perform) perform;
    decltype(&::curl_easy_getinfo) get;
    decltype(&::curl_easy_strerror) reason;
    decltype(&::curl_easy_cleanup) cleanup;
    decltype(&::curl_slist_append) append;
    decltype(&::curl_slist_free_all) free_all;

    Library()
        // The one that cfitsio needs, and so is there.
        : file("libcurl-gnutls.so.4", "--url"),
          init(file.find(decltype (&::curl_easy_init)(nullptr), "curl_easy_init")),
          set(file.find(decltype (&::curl_easy_setopt)(nullptr), "curl_easy_setopt")),
          perform(file.find(decltype (&::curl_easy_perform)(nullptr), "curl_easy_perform")),
          get(file.find(decltype (&::curl_easy_getinfo)(nullptr), "curl_easy_getinfo")),
          reason(file.find(decltype (&::curl_easy_strerror)(nullptr), "curl_easy_strerror")),
          cleanup(file.find(decltype (&::curl_easy_cleanup)(nullptr), "curl_easy_cleanup")),
          append(file.find(decltype (&::curl_slist_append)(nullptr), "curl_slist_append")),
          free_all(file.find(decltype (&::curl_slist_free_all)(nullptr), "curl_slist_free_all")) {}

    static const Library& get_it() {
        static const Library library;
        return library;
    }
};

namespace {

std::size_t take_body(char* bytes, std::size_t size, std::size_t count, void* answer) {
    auto& body = static_cast<HttpAnswer*>(answer)->body;
    if (body.size() + size * count > HttpClient::max_bytes) return 0; // ends the transfer
    body.append(bytes, size * count);
    return size * count;
}

std::size_t take_header(char* bytes, std::size_t size, std::size_t count, void* answer) {
    auto& headers = static_cast<HttpAnswer*>(answer)->headers;
    constexpr std::size_t max_headers = 100;
    const std::string_view line(bytes, size * count);
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos || headers.size() == max_headers) return size * count;
    std::string name(line.substr(0, colon));
    for (char& c : name)
        c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    const std::size_t begin = std::min(line.find_first_not_of(" \t", colon + 1), line.size());
    headers[name] = line.substr(begin, line.find_last_not_of(" \t\r\n") + 1 - begin);
    return size * count;
}

int give_up(void* /*context*/, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
    return host::interrupted() ? 1 : 0;
}

} // namespace

HttpClient::HttpClient(std::string_view verb, std::string url, std::string token,
                       const std::string& authority, double timeout_s)
    : verb_(verb), url_(std::move(url)), token_(std::move(token)), handle_(nullptr) {
    if (url_.rfind("http://", 0) != 0 && url_.rfind("https://", 0) != 0)
        throw host::UsageError(
            fmt::format("obscura {}: --url: \"{}\": allowed are https://HOST:PORT and http://HOST:PORT",
                        verb_, url_.substr(0, 100)));
    while (url_.ends_with('/'))
        url_.pop_back();
    if (std::any_of(token_.begin(), token_.end(),
                    [](char c) { return static_cast<unsigned char>(c) <= ' '; }))
        throw host::UsageError(
            fmt::format("obscura {}: --url: the token has blanks or line ends in it", verb_));
    const Library& curl = Library::get_it();
    handle_ = curl.init();
    if (handle_ == nullptr)
        throw HardwareError(fmt::format("obscura {}: --url: libcurl does not start", verb_));
    curl.set(handle_, CURLOPT_PROTOCOLS_STR, "http,https");
    curl.set(handle_, CURLOPT_PROXY, "");
    curl.set(handle_, CURLOPT_FOLLOWLOCATION, 0L);
    curl.set(handle_, CURLOPT_NOSIGNAL, 1L);
    curl.set(handle_, CURLOPT_CONNECTTIMEOUT, 10L);
    curl.set(handle_, CURLOPT_TIMEOUT_MS, static_cast<long>(1e3 * timeout_s));
    curl.set(handle_, CURLOPT_SSL_VERIFYPEER, 1L);
    curl.set(handle_, CURLOPT_SSL_VERIFYHOST, 2L);
    if (!authority.empty()) curl.set(handle_, CURLOPT_CAINFO, authority.c_str());
    curl.set(handle_, CURLOPT_WRITEFUNCTION, take_body);
    curl.set(handle_, CURLOPT_HEADERFUNCTION, take_header);
    curl.set(handle_, CURLOPT_NOPROGRESS, 0L);
    curl.set(handle_, CURLOPT_XFERINFOFUNCTION, give_up);
}

HttpClient::~HttpClient() {
    Library::get_it().cleanup(handle_);
}

HttpAnswer HttpClient::ask(std::string_view method, const std::string& path, const std::string& body) {
    const Library& curl = Library::get_it();
    const bool reads = method == "GET";
    curl_slist* headers = nullptr;
    if (!token_.empty()) headers = curl.append(headers, ("Authorization: Bearer " + token_).c_str());
    if (!reads) headers = curl.append(headers, "Content-Type: application/json");
    HttpAnswer answer;
    const std::string whole = url_ + path, word(method);
    curl.set(handle_, CURLOPT_URL, whole.c_str());
    curl.set(handle_, CURLOPT_HTTPHEADER, headers);
    curl.set(handle_, CURLOPT_WRITEDATA, &answer);
    curl.set(handle_, CURLOPT_HEADERDATA, &answer);
    if (reads) {
        curl.set(handle_, CURLOPT_HTTPGET, 1L);
    } else {
        curl.set(handle_, CURLOPT_POSTFIELDSIZE, static_cast<long>(body.size()));
        curl.set(handle_, CURLOPT_COPYPOSTFIELDS, body.c_str());
    }
    curl.set(handle_, CURLOPT_CUSTOMREQUEST, reads ? static_cast<const char*>(nullptr) : word.c_str());
    const CURLcode code = curl.perform(handle_);
    curl.free_all(headers);
    if (code == CURLE_ABORTED_BY_CALLBACK) throw host::Interrupted();
    if (code != CURLE_OK)
        throw HardwareError(fmt::format("obscura {}: {}: {}", verb_, url_, curl.reason(code)));
    curl.get(handle_, CURLINFO_RESPONSE_CODE, &answer.status);
    return answer;
}

} // namespace obscura::tools
