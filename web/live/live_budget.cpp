// SPDX-License-Identifier: Apache-2.0
#include "web/live/live_budget.hpp"

#include "web/live/live_message.hpp"

#include <algorithm>
#include <numeric>

namespace obscura::web {
namespace {

double bytes_of(const Wish& wish, const Share& share) {
    return static_cast<double>(picture_header_bytes) +
           static_cast<double>(share.view.bytes()) * (share.jpeg ? wish.jpeg_share : 1);
}

/// Rates by water-filling: viewers that take less than an equal share get all of it, and leave the rest to
/// the others.
void share_rates(std::span<const Wish> wishes, std::vector<Share>& shares, double bytes_per_s) {
    std::vector<std::size_t> order(shares.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto wanted = [&](std::size_t i) { return bytes_of(wishes[i], shares[i]) * wishes[i].hz; };
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return wanted(a) < wanted(b); });
    double left = bytes_per_s;
    for (std::size_t k = 0; k < order.size(); ++k) {
        const std::size_t i = order[k];
        const double given = std::min(wanted(i), left / static_cast<double>(order.size() - k));
        left -= given;
        shares[i].hz = std::min(wishes[i].hz, given / bytes_of(wishes[i], shares[i]));
    }
}

} // namespace

std::vector<Share> shared_out(std::span<const Wish> wishes, double bytes_per_s) {
    std::vector<Share> shares;
    for (const Wish& wish : wishes) {
        shares.push_back({wish.view, wish.hz, wish.encoding == PictureEncoding::jpeg});
        View& view = shares.back().view;
        while (view.bytes() > max_picture_bytes && view.bin < View::max_bin)
            view.bin *= 2;
    }
    // Digital numbers are given up before what they show.
    for (const bool relieve : {true, false})
        for (bool changed = true; changed;) {
            share_rates(wishes, shares, bytes_per_s);
            changed = false;
            for (std::size_t i = 0; i < shares.size(); ++i) {
                Share& share = shares[i];
                if (share.hz >= std::min(wishes[i].hz, min_hz)) continue;
                if (relieve && wishes[i].encoding == PictureEncoding::automatic && !share.jpeg) {
                    share.jpeg = changed = true;
                } else if (!relieve && share.view.bin < View::max_bin) {
                    share.view.bin *= 2;
                    changed = true;
                }
            }
        }
    return shares;
}

double Pace::at(Clock::time_point now) const {
    return std::min(most_, have_ + per_s_ * std::chrono::duration<double>(now - since_).count());
}

void Pace::set_rate(double per_s, Clock::time_point now) {
    have_ = at(now);
    since_ = now;
    per_s_ = per_s;
}

Pace::Clock::time_point Pace::time_of(double amount, Clock::time_point now) const {
    const double missing = amount - at(now);
    if (missing <= 0) return now;
    return now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(missing / per_s_));
}

void Pace::take(double amount, Clock::time_point now) {
    have_ = at(now) - amount;
    since_ = now;
}

} // namespace obscura::web
