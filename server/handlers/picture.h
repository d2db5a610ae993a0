#pragma once

#include <string>

#include "server/handlers/image_choice.h"
#include "server/http/request.h"
#include "server/http/response.h"
#include "server/jobs/job.h"
#include "server/services.h"

namespace tessera::server {

/// The answer to a request for a job's image: that image, as it is chosen, or 304. The ETag of a complete one is made
/// of `identity`, which says what the pixels depend on: the job's id does. In the quick lane it is one that was encoded
/// before, or TooHeavy is thrown.
Response picture_response(Services& services, const Request& request, const JobView& job, const ImageChoice& choice,
                          const std::string& identity);

/// An image may give way to those of others after it was rendered and before it is sent: then it is rendered again, up
/// to so many times in all, and refused.
inline constexpr unsigned kMostAttempts = 3;
proto::Problem gave_way();

/// The ETag of a complete image, before there is any.
std::string picture_etag(const std::string& identity, const ImageChoice& choice);
/// Whether the request says that who sent it has the image with this ETag.
bool is_known(const Request& request, const std::string& etag);
/// Whether a complete image of that job is there as it would be sent, even where its pixels have given way.
bool is_encoded(Services& services, const std::string& job, const ImageChoice& choice);

}  // namespace tessera::server
