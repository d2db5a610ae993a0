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
  const auto put = services.blobs.put(request.parameter, *request.file, request.abandoned);
  if (!put) return problem_response(put.problem());
  services.owners.add(request.who.owner, request.parameter, request.file->size());
  const bool created = *put == BlobStore::Put::created;
  return json_response(created ? 201 : 200, {{"blob", request.parameter}, {"bytes", request.file->size()}});
}

Response delete_blob(Services& services, Request& request) {
  const Deletion deletion = begin_deletion(services, request.who, request.parameter);
  if (deletion == Deletion::given_up) return {204, {}, ""};
  if (deletion == Deletion::not_theirs)
    return problem_response({proto::ProblemCode::not_found, "There is no such blob.", {}});
  const std::string& blob = request.parameter;
  switch (services.blobs.shelf().remove(hash_digits(blob), [&] { return services.scenes.names_blob(blob); })) {
    case Shelf::Removal::removed:
      services.owners.forget(request.parameter);
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
