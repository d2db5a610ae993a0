#include "client/commands/follow.h"

#include <optional>

#include <nlohmann/json.hpp>

#include "client/failure.h"
#include "client/progress_bar.h"

namespace tessera::client {
namespace {

/// The speed so far, where the server knows one.
std::optional<double> mrays_per_second(const Client& client, const std::string& id) {
  const nlohmann::json stats = client.stats(id);
  const auto speed = stats.find("mrays_per_second");
  if (speed == stats.end() || !speed->is_number()) return std::nullopt;
  return speed->get<double>();
}

}  // namespace

proto::JobStatus follow(Session& session, const std::string& id) {
  session.on_interrupt("job " + id + " goes on; 'tessera cancel " + id + "' ends it", id);
  const Client client = session.client();
  proto::JobStatus status;
  {
    ProgressBar bar(stderr);
    status = client.watch(id, [&](const proto::JobStatus& now) {
      if (session.json && !bar.is_on_terminal()) return;
      const bool has_speed = bar.is_on_terminal() && now.samples_done > 0;
      bar.show(now, has_speed ? mrays_per_second(client, id) : std::nullopt);
    });
  }
  session.on_interrupt("");
  if (status.state != proto::JobState::completed) {
    const std::string why = status.error.empty() ? "" : ": " + status.error;
    session.fail(ExitCode::job_did_not_complete, "job " + id + ' ' + std::string(proto::name(status.state)) + why,
                 {{"job", id}});
  }
  return status;
}

}  // namespace tessera::client
