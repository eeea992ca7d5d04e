// SPDX-License-Identifier: Apache-2.0
#include "web/server/answer_writer.hpp"

#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/write.hpp>

#include <utility>

namespace obscura::web {
namespace {

namespace http = boost::beast::http;

class Writing : public std::enable_shared_from_this<Writing> {
public:
    Writing(Stream& stream, std::shared_ptr<Answer> answer, std::chrono::milliseconds timeout,
            std::function<void(Stream::ErrorCode, std::size_t)> done)
        : stream_(stream),
          answer_(std::move(answer)),
          timeout_(timeout),
          done_(std::move(done)),
          serializer_(*answer_) {
        serializer_.limit(part_bytes);
    }

    void write_head() {
        stream_.next_layer().expires_after(timeout_);
        http::async_write_header(stream_, serializer_,
                                 [self = shared_from_this()](Stream::ErrorCode error, std::size_t bytes) {
                                     self->done_(error, bytes);
                                 });
    }

    void write_next() {
        stream_.next_layer().expires_after(timeout_);
        http::async_write_some(stream_, serializer_,
                               [self = shared_from_this()](Stream::ErrorCode error, std::size_t bytes) {
                                   self->sent_ += bytes;
                                   if (error || self->serializer_.is_done())
                                       self->done_(error, self->sent_);
                                   else
                                       self->write_next();
                               });
    }

private:
    Stream& stream_;
    const std::shared_ptr<Answer> answer_;
    const std::chrono::milliseconds timeout_;
    const std::function<void(Stream::ErrorCode, std::size_t)> done_;
    http::response_serializer<http::string_body> serializer_;
    std::size_t sent_ = 0;
};

} // namespace

void write_answer(Stream& stream, std::shared_ptr<Answer> answer, bool head,
                  std::chrono::milliseconds timeout,
                  std::function<void(Stream::ErrorCode, std::size_t)> done) {
    const auto writing = std::make_shared<Writing>(stream, std::move(answer), timeout, std::move(done));
    if (head)
        writing->write_head();
    else
        writing->write_next();
}

} // namespace obscura::web
