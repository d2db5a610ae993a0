#include <string>

#include <nlohmann/json.hpp>

#include "server/handlers/handlers.h"
#include "server/handlers/own.h"
#include "server/store/blob_store.h"
#include "server/store/owners.h"
#include "server/store/scene_store.h"

namespace tessera::server {
using proto::ProblemCode;

Response put_blob(Services& services, Request& request) {
  if (const auto refused = refuse_bytes(services, request.who, request.parameter, request.file->size()))
    return problem_response(*refused);
  // Until it is theirs: another owner may be deleting it.
  const auto hold = services.blobs.shelf().hold(hash_digits(request.parameter));
  const auto put = services.blobs.put(request.parameter, *request.file, request.abandoned);
  if (!put) return problem_response(put.problem());
  services.owners.add(request.who.owner, request.parameter, request.file->size());
  const bool created = *put == BlobStore::Put::created;
  return json_response(created ? 201 : 200, {{"blob", request.parameter}, {"bytes", request.file->size()}});
}

Response delete_blob(Services& services, Request& request) {
  const std::string& blob = request.parameter;
  const auto remove = [&](const IsOthers& is_others) {
    return services.blobs.shelf().remove(hash_digits(blob),
                                         [&] { return is_others() || services.scenes.names_blob(blob); });
  };
  switch (delete_own(services, request.who, blob, remove)) {
    case Shelf::Removal::removed:
      return {204, {}, ""};
    case Shelf::Removal::held:
      return problem_response({ProblemCode::in_use, "A scene that is being read needs this blob.", {}});
    case Shelf::Removal::needed:
      return problem_response({ProblemCode::in_use, "A stored scene names this blob; delete that first.", {}});
    case Shelf::Removal::expired:
      return problem_response({ProblemCode::gone, "The blob has expired.", {}});
    case Shelf::Removal::missing:
      break;
  }
  return problem_response({ProblemCode::not_found, "There is no such blob.", {}});
}

}  // namespace tessera::server
