// SPDX-License-Identifier: Apache-2.0
// The calls that every connection has.
#include "core/error.hpp"
#include "core/fnv.hpp"
#include "core/io/memory_budget.hpp"
#include "service/connection.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <utility>

namespace obscura::service {

using nlohmann::json;

void Connection::prove(const std::string& proof) {
    if (access_.tokens == nullptr) return;
    const std::string challenge = std::exchange(challenge_, {});
    Failure failure(FailureCode::forbidden, "this server wants a token");
    failure.field = "proof";
    failure.hint = "the call challenge, then hello with the proof";
    if (proof.empty() || challenge.empty()) {
        if (!access_.permission) throw failure;
        return;
    }
    const std::optional<Permission> permission =
        access_.tokens->permission_of(challenge, proof, access_.peer, Clock::now());
    if (!permission) throw Failure(FailureCode::forbidden, "the token is not one of this server's");
    access_.permission = permission;
}

Answer Connection::open_memory(std::size_t slots, std::uint64_t bytes) {
    if (!access_.passes_files)
        throw Failure(FailureCode::forbidden, "memory.open: memory is shared over a Unix socket only");
    if (bytes > limits_.shared_bytes / slots)
        throw Failure(FailureCode::too_large,
                      fmt::format("memory.open: {} slots of {} bytes, allowed {} in all", slots, bytes,
                                  limits_.shared_bytes));
    const std::lock_guard lock(ring_mutex_);
    ring_.reset();
    ring_share_ = {};
    ring_share_ = context_.memory.take(slots * bytes);
    try {
        require_memory(slots * bytes, "shared memory");
        ring_ = std::make_shared<SharedRing>(slots, static_cast<std::size_t>(bytes));
    } catch (const Error& error) {
        throw Failure(FailureCode::too_large, error.what());
    }
    Answer answer{{{"slots", slots}, {"stride", ring_->stride()}, {"head_bytes", SharedRing::head_bytes}}};
    answer.keep = ring_;
    answer.descriptors = {ring_->file()};
    return answer;
}

Calls Connection::all_calls(Connection* self, Session& session) {
    Calls all = own_calls(self);
    for (Call& call : session.calls())
        all.push_back(std::move(call));
    return all;
}

std::string Connection::api_of(Host& host) {
    const std::unique_ptr<Session> session = host.open();
    return fmt::format("{:016x}", fnv1a(describe(all_calls(nullptr, *session)).dump()));
}

Answer Connection::hello_answer() {
    json limits = context_.host.limits();
    limits["clients"] = limits_.clients;
    limits["head_bytes"] = limits_.head_bytes;
    limits["body_bytes"] = limits_.body_bytes;
    limits["head_depth"] = limits_.head_depth;
    limits["memory_bytes"] = limits_.memory_bytes;
    limits["shared_bytes"] = limits_.shared_bytes;
    limits["requests"] = limits_.requests;
    limits["streams"] = limits_.streams;
    limits["credits"] = limits_.credits;
    return {{{"server", "obscura"},
             {"version", context_.host.version()},
             {"protocol", protocol_version},
             {"api", context_.api},
             {"permission", name_of(access_.permission.value_or(Permission::view))},
             {"codecs", names_of_enum<Codec>()},
             {"limits", std::move(limits)}}};
}

namespace {

struct Hello {
    std::uint32_t least = protocol_version, most = protocol_version;
    std::string client, proof;

    Fields fields() {
        return {
            {config::key("protocol_min", &least).range(0, 255).help("Oldest version that the client speaks"),
             config::key("protocol_max", &most).range(0, 255).help("Newest version that the client speaks"),
             config::key("client", &client).help("Name and version of the client, for messages"),
             config::key("proof", &proof)
                 .help(
                     "Where the server wants a token: "
                     "HMAC-SHA256 of the bytes of its challenge, keyed by the 32 bytes of the token, in 64 lower-case hexadecimal digits")}};
    }
};

struct OpenMemory {
    std::uint32_t slots = 4;
    std::uint64_t bytes = std::uint64_t{64} << 20;

    Fields fields() {
        return {{config::key("slots", &slots)
                     .range(2, 64)
                     .help("Answers that are there at a time: each overwrites the oldest"),
                 config::key("bytes", &bytes).range(4096, 1e12).help("Room of a slot")}};
    }
};

struct Cancel {
    std::uint32_t request = 0;

    Fields fields() {
        return {{config::key("request", &request)
                     .help("Number of the request, as its message had it; 0: all of the connection")}};
    }
};

struct Credit {
    std::uint32_t request = 0, frames = 1;

    Fields fields() {
        return {{config::key("request", &request)
                     .required()
                     .help("Number of the request that opened the stream, as its message had it"),
                 config::key("frames", &frames).range(1, 1000).help("Frames that it may send further")}};
    }
};

/// Results of the calls, in the order of own_calls().
void set_results(Calls& calls) {
    calls[0].results = {
        {"server", "string", "", "\"obscura\""},
        {"version", "string", "", "Version of the server"},
        {"protocol", "integer", "", "Version of the protocol that is spoken"},
        {"api", "string", "", "Hash of the table of calls"},
        {"permission", "string", "", "What the connection may do: view, operate, scene or admin"},
        {"codecs", "array of strings", "", "Codecs of arrays that the server has"},
        {"limits", "map", "", "Largest messages, pictures and numbers of requests and clients"}};
    calls[1].results = {{"challenge", "string", "", "64 hexadecimal digits"}};
    calls[2].results = {{"calls", "array of maps", "", "Rows: name, help, permission, fields, results"},
                        {"sections", "array of maps", "", "Tables of scenes: heading, help, keys"}};
    calls[3].results = {{"waiting", "integer", "", "Requests that wait"},
                        {"streams", "integer", "", "Streams that are open"},
                        {"call", "string", "", "Name of the request in progress; missing: none is"},
                        {"request", "integer", "", "Its number"},
                        {"done", "integer", "", "Parts of it that are done"},
                        {"total", "integer", "", "Parts of it"}};
    calls[4].results = {{"cancelled", "integer", "", "Requests that were found"}};
    calls[5].results = {
        {"credits", "integer", "", "Frames that it may send now; 0: there is no such stream"}};
    calls[6].results = {{"slots", "integer", "", "Number of slots"},
                        {"stride", "integer", "bytes", "From one slot to the next"},
                        {"head_bytes", "integer", "bytes", "Head of a slot, before the arrays"}};
}

} // namespace

Calls Connection::own_calls(Connection* self) {
    Calls calls{
        call<Hello>("hello", Permission::view,
                    "Begins a connection: agrees on the version of the protocol. The first request.",
                    [self](const Hello& hello, Work& /*work*/) {
                        if (hello.least > protocol_version || hello.most < protocol_version) {
                            Failure failure(FailureCode::no_hello,
                                            fmt::format("versions {} to {} of the protocol, allowed {}",
                                                        hello.least, hello.most, protocol_version));
                            failure.field = "protocol_min";
                            failure.allowed = fmt::format("{}", protocol_version);
                            throw failure;
                        }
                        self->prove(hello.proof);
                        self->greeted_ = true;
                        return self->hello_answer();
                    }),
        call<NoArguments>(
            "challenge", Permission::view,
            "Asks for random bytes with which the next hello proves that the client has a token. "
            "Each serves for one hello. Needs none itself.",
            [self](const NoArguments&, Work& /*work*/) {
                self->challenge_ = make_challenge();
                return Answer{{{"challenge", self->challenge_}}};
            }),
        call<NoArguments>("describe", Permission::view,
                          "Lists the calls with their fields, and the keys of scenes.",
                          [self](const NoArguments&, Work& /*work*/) {
                              Answer answer{self->session_->description()};
                              answer.head["calls"] = describe(self->calls_);
                              return answer;
                          }),
        call<NoArguments>(
            "status", Permission::view,
            "Tells what the connection's request in progress is, and how far. Does not wait for it.",
            [self](const NoArguments&, Work& /*work*/) { return self->status(); }),
        call<Cancel>(
            "cancel", Permission::view,
            "Cancels a request, which is answered with the error \"cancelled\". Does not wait for others.",
            [self](const Cancel& arguments, Work& /*work*/) {
                return Answer{{{"cancelled", self->cancel(arguments.request)}}};
            }),
        call<Credit>("credit", Permission::view,
                     "Grants a stream of the connection further frames, each of which costs it one. "
                     "Does not wait for others.",
                     [self](const Credit& arguments, Work& /*work*/) {
                         return Answer{{{"credits", self->grant(arguments.request, arguments.frames)}}};
                     }),
        call<OpenMemory>(
            "memory.open", Permission::view,
            "From the next request on, arrays of answers stand in shared memory where they fit. "
            "With the first byte of the answer comes the descriptor of the file, to be mapped for reading. "
            "Over a Unix socket only.",
            [self](const OpenMemory& arguments, Work& /*work*/) {
                return self->open_memory(arguments.slots, arguments.bytes);
            }),
        call<NoArguments>("close", Permission::view,
                          "Ends the connection; what is in progress or waits is cancelled.",
                          [self](const NoArguments&, Work& /*work*/) {
                              (void)self->cancel(0);
                              self->ends_ = Clock::now() + linger_timeout;
                              return Answer{};
                          }),
    };
    for (Call& call : calls)
        call.overtakes = call.name != "describe" && call.name != "memory.open";
    calls[0].lenient = true;
    set_results(calls);
    return calls;
}

} // namespace obscura::service
