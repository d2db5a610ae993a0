#include "server/handlers/own.h"

#include "server/jobs/job_table.h"
#include "server/store/blob_store.h"
#include "server/store/owners.h"

namespace tessera::server {
namespace {

/// Seconds: nothing is given back by waiting alone.
constexpr std::uint32_t kBeforeMoreBytes = 60;

}  // namespace

proto::Result<JobView> find_job(Services& services, const Request& request) {
  auto job = services.jobs.find(request.parameter);
  if (job && !request.who.sees(job->order->owner)) return no_such_job();
  return job;
}

std::optional<proto::Problem> refuse_bytes(Services& services, const Principal& who, const proto::ContentHash& hash,
                                           std::uint64_t bytes) {
  if (!who.key || !who.key->limits.stored_bytes || services.owners.bytes_of(who.owner, hash) > 0) return std::nullopt;
  const std::uint64_t most = *who.key->limits.stored_bytes, stored = services.owners.bytes_of(who.owner);
  if (stored + bytes <= most) return std::nullopt;
  return proto::Problem{proto::ProblemCode::quota_exceeded,
                        "With these " + std::to_string(bytes) + " bytes " + who.owner + " would have " +
                            std::to_string(stored + bytes) + " stored, and this key allows " + std::to_string(most) +
                            ".",
                        {},
                        kBeforeMoreBytes};
}

Shelf::Removal delete_own(Services& services, const Principal& who, const proto::ContentHash& hash,
                          const std::function<Shelf::Removal(const IsOthers&)>& remove) {
  if (who.may(proto::Scope::admin)) {
    const Shelf::Removal removal = remove([] { return false; });
    if (removal == Shelf::Removal::removed) services.owners.forget(hash);
    return removal;
  }
  if (!services.owners.has(who.owner, hash)) return Shelf::Removal::missing;
  bool is_others = false;
  const auto look = [&] { return is_others = services.owners.has_others(who.owner, hash); };
  const Shelf::Removal removal = remove(look);
  if (removal == Shelf::Removal::held) look();
  if (!is_others && removal != Shelf::Removal::removed) return removal;
  services.owners.remove(who.owner, hash);
  return Shelf::Removal::removed;
}

proto::Result<proto::SourceFile> OwnFiles::blob(const proto::ContentHash& hash, const std::stop_token& stop) const {
  const bool may_use = who_.may(proto::Scope::admin) || services_.owners.has(who_.owner, hash);
  if (!may_use && proto::is_content_hash(hash)) return no_such_blob(hash);
  return services_.blobs.blob(hash, stop);
}

proto::Result<proto::SourceFile> OwnFiles::asset(std::string_view relative_path, const std::stop_token& stop) const {
  return services_.blobs.asset(relative_path, stop);
}

const proto::AssetReader& OwnFiles::reader() const { return services_.blobs.reader(); }

}  // namespace tessera::server
