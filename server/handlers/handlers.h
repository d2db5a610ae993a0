#pragma once

#include "server/http/request.h"
#include "server/http/response.h"
#include "server/services.h"

/// What the routes do, one function each: from a request and the services to a response, without sockets.
namespace tessera::server {

Response put_blob(Services& services, Request& request);
Response delete_blob(Services& services, Request& request);

Response post_scene(Services& services, Request& request);
Response describe_scene(Services& services, Request& request);
Response delete_scene(Services& services, Request& request);

Response post_job(Services& services, Request& request);
Response list_jobs(Services& services, Request& request);
Response show_job(Services& services, Request& request);
Response cancel_job(Services& services, Request& request);
Response delete_job(Services& services, Request& request);

Response watch_job(Services& services, Request& request);
Response watch_jobs(Services& services, Request& request);

Response post_render(Services& services, Request& request);
Response post_drake_render(Services& services, Request& request);

Response fetch_image(Services& services, Request& request);
Response show_plan(Services& services, Request& request);
Response show_stats(Services& services, Request& request);

Response livez(Services& services, Request& request);
Response show_metrics(Services& services, Request& request);
Response readyz(Services& services, Request& request);
Response show_version(Services& services, Request& request);
Response show_capabilities(Services& services, Request& request);
Response show_openapi(Services& services, Request& request);
Response list_schemas(Services& services, Request& request);
Response show_scene_schema(Services& services, Request& request);
Response show_job_schema(Services& services, Request& request);
Response list_problems(Services& services, Request& request);
Response show_problem(Services& services, Request& request);

}  // namespace tessera::server
