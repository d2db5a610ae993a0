#include <optional>
#include <span>
#include <stdexcept>
#include <string>

#include "core/io/image_io.h"
#include "proto/wire/sha256.h"
#include "server/handlers/handlers.h"
#include "server/image_choice.h"
#include "server/job_table.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

/// Whether an If-None-Match header covers the tag (RFC 9110, 13.1.2: weak comparison).
bool covers(std::string_view if_none_match, std::string_view etag) {
  while (!if_none_match.empty()) {
    const std::size_t comma = if_none_match.find(',');
    std::string_view tag = if_none_match.substr(0, comma);
    tag.remove_prefix(std::min(tag.find_first_not_of(" \t"), tag.size()));
    tag = tag.substr(0, tag.find_last_not_of(" \t") + 1);
    if (tag.starts_with("W/")) tag.remove_prefix(2);
    if (tag == "*" || tag == etag) return true;
    if_none_match = comma == std::string_view::npos ? std::string_view{} : if_none_match.substr(comma + 1);
  }
  return false;
}

std::optional<std::vector<std::byte>> encode_film(const Film& film, const ImageChoice& choice, bool complete) {
  if (complete) return encode(film.pixels(), choice.plane, choice.format.format);
  std::vector<std::uint8_t> done;
  const Pixels pixels = film.snapshot(&done);
  return encode(pixels, choice.plane, choice.format.format, &done);
}

}  // namespace

Response fetch_image(Services& services, Request& request) {
  const auto job = services.jobs.find(request.parameter);
  if (!job) return problem_response(job.problem());
  const auto choice = choose_image(request, job->order->settings.aovs);
  if (!choice) return problem_response(choice.problem());
  const bool complete = job->state == proto::JobState::completed;
  if (!job->film || (!complete && !choice->partial))
    return problem_response(
        {ProblemCode::image_not_ready,
         "The job is " + std::string(proto::name(job->state)) +
             (job->film ? "; ?partial=1 gives the image so far." : "; there is nothing of its image."),
         {}});

  const auto encoded = encode_film(*job->film, *choice, complete);
  if (!encoded) throw std::runtime_error("encoding an image of job " + job->id + " failed");
  std::string body(reinterpret_cast<const char*>(encoded->data()), encoded->size());
  const std::string etag = '"' + proto::content_hash(body) + '"';
  Response response;
  response.headers = {{"ETag", etag}, {"Vary", "Accept"}, {"Cache-Control", complete ? "no-cache" : "no-store"}};
  if (covers(request.header("if-none-match").value_or(""), etag)) {
    response.status = 304;
    return response;
  }
  response.headers.emplace_back("Content-Type", choice->format.media_type);
  response.body = std::move(body);
  return response;
}

}  // namespace tessera::server
