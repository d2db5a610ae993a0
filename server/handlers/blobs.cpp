#include <nlohmann/json.hpp>

#include "server/handlers/handlers.h"
#include "server/handlers/own.h"
#include "server/store/blob_store.h"
#include "server/store/owners.h"

namespace tessera::server {

Response put_blob(Services& services, Request& request) {
  if (const auto refused = refuse_bytes(services, request.who, request.parameter, request.file->size()))
    return problem_response(*refused);
  const auto put = services.blobs.put(request.parameter, *request.file, request.abandoned);
  if (!put) return problem_response(put.problem());
  services.owners.add(request.who.owner, request.parameter, request.file->size());
  const bool created = *put == BlobStore::Put::created;
  return json_response(created ? 201 : 200, {{"blob", request.parameter}, {"bytes", request.file->size()}});
}

}  // namespace tessera::server
