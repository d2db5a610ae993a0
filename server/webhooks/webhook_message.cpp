#include "server/webhooks/webhook_message.h"

#include <chrono>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "server/rfc3339.h"

namespace tessera::server {

WebhookMessage webhook_message(const JobView& job) {
  using nlohmann::json;
  const auto ended = job.times.ended.value_or(job.times.queued);
  proto::JobStatus status = status_of(job, ended);
  status.webhook.reset();  // Who reads this has it.
  const std::string path = "/v1/jobs/" + job.id;
  json links{{"job", path}};
  if (job.image != proto::ImageState::none) links["image"] = path + "/image";
  const auto lasted = std::chrono::duration_cast<std::chrono::system_clock::duration>(ended - job.times.queued);
  const json message{{"type", "job." + std::string(proto::name(job.state))},
                     {"timestamp", rfc3339(job.times.created + lasted)},
                     {"data", {{"job", to_json(status)}, {"links", std::move(links)}}}};
  return {"msg_" + job.id, message.dump()};
}

}  // namespace tessera::server
