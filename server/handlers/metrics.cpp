#include "server/handlers/handlers.h"
#include "server/metrics/exposition.h"

namespace tessera::server {

Response show_metrics(Services& services, Request&) {
  return {200, {{"Content-Type", kExpositionType}, {"Cache-Control", "no-store"}}, exposition(services)};
}

}  // namespace tessera::server
