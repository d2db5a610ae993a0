#include <nlohmann/json.hpp>

#include "server/handlers/handlers.h"
#include "server/store/blob_store.h"

namespace tessera::server {

Response put_blob(Services& services, Request& request) {
  const auto put = services.blobs.put(request.parameter, *request.file);
  if (!put) return problem_response(put.problem());
  const bool created = *put == BlobStore::Put::created;
  return json_response(created ? 201 : 200, {{"blob", request.parameter}, {"bytes", request.file->size()}});
}

}  // namespace tessera::server
