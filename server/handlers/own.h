#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string_view>
#include <utility>

#include "proto/file_source.h"
#include "proto/wire/result.h"
#include "server/http/principal.h"
#include "server/http/request.h"
#include "server/jobs/job.h"
#include "server/services.h"
#include "server/store/shelf.h"

/// What is there for who asks: what others have looks to them as if it weren't there.
namespace tessera::server {

/// The job that a request's path names, if its owner is who asks, or who asks is an admin; else `not_found`.
proto::Result<JobView> find_job(Services& services, const Request& request);

/// `quota_exceeded` where a key's owner may not have so many bytes more; unless they are this hash's, and there
/// already.
std::optional<proto::Problem> refuse_bytes(Services& services, const Principal& who, const proto::ContentHash& hash,
                                           std::uint64_t bytes);

/// Deletes a blob or a scene for `who`. What others have, too, is only given up, which is `removed` as well; what isn't
/// there for `who` is `missing`. `remove` removes the file, unless it is held, or what it is given says that others
/// have it, which is asked when nobody can come to have it meanwhile.
using IsOthers = std::function<bool()>;
Shelf::Removal delete_own(Services& services, const Principal& who, const proto::ContentHash& hash,
                          const std::function<Shelf::Removal(const IsOthers&)>& remove);

/// The files that documents may name: blobs that one of the owner's keys has put, since knowing a hash is no right to
/// what has it, and all of the asset root.
class OwnFiles : public proto::FileSource {
 public:
  OwnFiles(Services& services, Principal who) : services_(services), who_(std::move(who)) {}

  proto::Result<proto::SourceFile> blob(const proto::ContentHash& hash, const std::stop_token& stop) const override;
  proto::Result<proto::SourceFile> asset(std::string_view relative_path, const std::stop_token& stop) const override;
  const proto::AssetReader& reader() const override;

 private:
  Services& services_;
  const Principal who_;
};

}  // namespace tessera::server
