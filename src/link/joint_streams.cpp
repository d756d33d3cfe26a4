// Telemetry and uploads of a `JointEndpoint`.
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "torsio/link/joint_endpoint.hpp"

namespace torsio {
namespace {

std::uint32_t channel_mask(std::size_t channels) noexcept {
  return channels >= 32 ? ~std::uint32_t{0} : (std::uint32_t{1} << channels) - 1U;
}

std::uint32_t continued_crc(std::uint32_t crc, std::span<const std::uint8_t> bytes) noexcept {
  return static_cast<std::uint32_t>(crc32_z(crc, bytes.data(), bytes.size()));
}

}  // namespace

LinkRefusal JointEndpoint::subscribe(const LinkSubscribe& message, Context& context,
                                     LinkSubscription& reply) noexcept {
  const std::uint8_t host = context.route.sender;
  Subscriber* place = nullptr;
  double others_B_s = 0.0;
  for (Subscriber& each : subscribers_) {
    if (each.host != kNdlcomReserved && each.until_ns <= context.now_ns) each = {};
    if (each.host == host)
      place = &each;
    else
      others_B_s += each.line_B_s;
  }
  if (message.mask == 0) {
    if (place != nullptr) *place = {};
    return LinkRefusal::none;
  }
  if ((message.mask & ~channel_mask(joint_.channels().size())) != 0)
    return LinkRefusal::out_of_range;
  const auto rate_Hz = double{message.rate_Hz};
  const auto lifetime_s = double{message.lifetime_s};
  const double slowest_Hz = settings_.tick_rate_Hz / 1e6;
  if (!(rate_Hz >= slowest_Hz && rate_Hz <= settings_.tick_rate_Hz))
    return LinkRefusal::out_of_range;
  if (!(lifetime_s > 0.0 && lifetime_s <= kLongestLifetime_s)) return LinkRefusal::out_of_range;
  const auto period_ticks =
      static_cast<std::uint32_t>(std::lround(settings_.tick_rate_Hz / rate_Hz));
  const double rounded_Hz = settings_.tick_rate_Hz / period_ticks;
  const auto channels = static_cast<std::size_t>(std::popcount(message.mask));
  const LineBudget::Verdict verdict = line_.check(others_B_s, channels, rounded_Hz);
  reply.rate_Hz = static_cast<float>(rounded_Hz);
  reply.asked_B_s = static_cast<float>(verdict.asked_B_s);
  reply.available_B_s = static_cast<float>(verdict.available_B_s);
  if (!verdict.fits) return LinkRefusal::line_too_slow;
  if (place == nullptr) {
    auto* const free = std::ranges::find(subscribers_, kNdlcomReserved, &Subscriber::host);
    if (free == subscribers_.end()) return LinkRefusal::too_many_subscribers;
    place = free;
  }
  const bool is_renewed = place->mask == message.mask && place->period_ticks == period_ticks;
  const std::uint32_t sequence = is_renewed ? place->sequence : 0;
  const std::uint32_t left_ticks = is_renewed ? place->left_ticks : 0;
  *place = {.host = host,
            .mask = message.mask,
            .period_ticks = period_ticks,
            .left_ticks = left_ticks,
            .sequence = sequence,
            .until_ns = context.now_ns + static_cast<std::uint64_t>(lifetime_s * 1e9),
            .line_B_s = verdict.asked_B_s - others_B_s};
  return LinkRefusal::none;
}

LinkRefusal JointEndpoint::execute(const LinkSubscribe& message, Context& context) noexcept {
  LinkSubscription reply{.mask = message.mask, .rate_Hz = message.rate_Hz};
  reply.refusal = subscribe(message, context, reply);
  send(context.route.sender, reply);
  context.has_replied = true;
  return reply.refusal;
}

void JointEndpoint::send_telemetry(std::uint64_t now_ns) noexcept {
  std::array<float, kLinkChannels> values{};
  bool is_measured = false;
  for (Subscriber& each : subscribers_) {
    if (each.host == kNdlcomReserved) continue;
    if (each.until_ns <= now_ns) {
      each = {};
      continue;
    }
    if (each.left_ticks > 0) {
      --each.left_ticks;
      continue;
    }
    each.left_ticks = each.period_ticks - 1;
    if (!is_measured) joint_.measure(std::span(values).first(joint_.channels().size()));
    is_measured = true;
    LinkTelemetry telemetry{.time_ns = now_ns, .sequence = each.sequence++, .mask = each.mask};
    for (std::uint32_t left = each.mask; left != 0; left &= left - 1)
      telemetry.values.values[telemetry.values.count++] =
          values[static_cast<std::size_t>(std::countr_zero(left))];
    send(each.host, telemetry);
  }
}

LinkRefusal JointEndpoint::execute(const LinkChannelDescribe& message, Context& context) noexcept {
  const auto channels = joint_.channels();
  if (message.index >= channels.size()) return LinkRefusal::out_of_range;
  send(context.route.sender,
       LinkChannelDescription{.index = message.index,
                              .count = static_cast<std::uint8_t>(channels.size()),
                              .name = channels[message.index]});
  return LinkRefusal::none;
}

LinkRefusal JointEndpoint::reply_upload(Context& context, LinkRefusal refusal) noexcept {
  send(context.route.sender,
       LinkUpload{.state = upload_.state, .refusal = refusal, .received = upload_.received});
  context.has_replied = true;
  return refusal;
}

LinkRefusal JointEndpoint::execute(const LinkUploadBegin& message, Context& context) noexcept {
  if (upload_.is_checked) return reply_upload(context, LinkRefusal::not_in_this_state);
  upload_ = {};
  if (message.size == 0) return reply_upload(context, LinkRefusal::upload_rejected);
  const std::span<std::uint8_t> space = joint_.begin_upload(message.size, message.actuator);
  if (space.size() < message.size) {
    upload_.state = LinkUploadState::rejected;
    return reply_upload(context, LinkRefusal::upload_rejected);
  }
  upload_ = {.state = LinkUploadState::receiving,
             .space = space.first(message.size),
             .received = 0,
             .crc = message.crc};
  return reply_upload(context, LinkRefusal::none);
}

LinkRefusal JointEndpoint::execute(const LinkUploadChunk& message, Context& context) noexcept {
  const bool is_next = upload_.state == LinkUploadState::receiving &&
                       message.offset == upload_.received && !message.data.empty() &&
                       message.data.size() <= upload_.space.size() - upload_.received;
  if (!is_next) return reply_upload(context, LinkRefusal::upload_out_of_order);
  std::memcpy(upload_.space.data() + upload_.received, message.data.data(), message.data.size());
  upload_.received_crc = continued_crc(upload_.received_crc, message.data);
  upload_.received += static_cast<std::uint32_t>(message.data.size());
  if (upload_.received == upload_.space.size()) upload_.state = LinkUploadState::complete;
  return reply_upload(context, LinkRefusal::none);
}

LinkRefusal JointEndpoint::execute(const LinkUploadCommit& message, Context& context) noexcept {
  if (upload_.is_checked) return reply_upload(context, LinkRefusal::not_in_this_state);
  if (upload_.state != LinkUploadState::complete)
    return reply_upload(context, LinkRefusal::upload_out_of_order);
  std::optional<LinkRefusal> result = LinkRefusal::upload_rejected;
  if (message.crc == upload_.crc && upload_.received_crc == upload_.crc) {
    result = joint_.commit_upload(upload_.space);
    if (result == LinkRefusal::none) result = joint_.poll_upload();
  }
  upload_.host = context.route.sender;
  if (result) end_upload(*result);
  upload_.is_checked = !result;
  return reply_upload(context, result.value_or(LinkRefusal::none));
}

void JointEndpoint::end_upload(LinkRefusal result) noexcept {
  upload_.state =
      result == LinkRefusal::none ? LinkUploadState::committed : LinkUploadState::rejected;
  upload_.space = {};
  upload_.is_checked = false;
}

/// Not a reply to a message: the check has lasted longer than the message of the commit.
void JointEndpoint::poll_upload() noexcept {
  if (!upload_.is_checked) return;
  const std::optional<LinkRefusal> result = joint_.poll_upload();
  if (!result) return;
  end_upload(*result);
  if (*result != LinkRefusal::none) ++counts_.refused[static_cast<std::size_t>(*result)];
  send(upload_.host,
       LinkUpload{.state = upload_.state, .refusal = *result, .received = upload_.received});
}

LinkRefusal JointEndpoint::execute(const LinkUploadAbort& /*message*/, Context& context) noexcept {
  if (upload_.is_checked) return reply_upload(context, LinkRefusal::not_in_this_state);
  upload_ = {};
  return reply_upload(context, LinkRefusal::none);
}

}  // namespace torsio
