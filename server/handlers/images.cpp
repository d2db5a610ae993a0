#include <algorithm>
#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>

#include "core/film/aov_table.h"
#include "core/io/image_io.h"
#include "proto/wire/abandoned.h"
#include "proto/wire/sha256.h"
#include "server/handlers/handlers.h"
#include "server/handlers/image_choice.h"
#include "server/handlers/own.h"
#include "server/handlers/picture.h"
#include "server/http/byte_range.h"
#include "server/http/lane.h"
#include "server/jobs/job_submission.h"
#include "server/jobs/job_table.h"
#include "server/store/image_cache.h"

namespace tessera::server {
using proto::ImageState;
using proto::ProblemCode;

namespace {

/// Of an image that isn't complete, to be asked for one by one in the quick lane.
constexpr std::size_t kQuickTiles = 10'000;

/// Of what never changes at its address, for who asked alone (RFC 8246; RFC 9111, 5.2.2.7).
constexpr const char* kForGood = "private, max-age=31536000, immutable";

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

/// A job's image, and what is asked for of it.
struct Picture {
  std::string job;
  std::shared_ptr<const Film> film;
  bool complete;
  ImageChoice choice;
};

/// The AOVs that a plane's image shows.
std::set<Aov> aovs_of(Plane plane, const std::set<Aov>& recorded) {
  if (plane.is_all) return recorded;
  if (plane.aov) return {*plane.aov};
  return recorded.contains(Aov::alpha) ? std::set<Aov>{Aov::alpha} : std::set<Aov>{};
}

std::string name_of(Plane plane) {
  if (plane.is_all) return "all";
  return plane.aov ? std::string(aov_entry(*plane.aov).name) : "color";
}

/// All that the bytes depend on: a tile's pixels are the same as long as its version is, no id comes twice, and one
/// version of this program encodes equal pixels to equal bytes. `versions` is given where the image isn't complete.
std::string key_of(const std::string& id, const ImageChoice& choice, const std::vector<std::uint32_t>* versions) {
  std::string key = id + " plane " + name_of(choice.plane) + ' ' + std::string(choice.format.name);
  const Encoding& encoding = choice.encoding;
  if (encoding.format == ImageFormat::jpeg)
    key +=
        ' ' + std::to_string(encoding.jpeg.quality) + '/' + std::to_string(static_cast<int>(encoding.jpeg.subsampling));
  if (encoding.precision == Precision::half) key += " half";
  if (encoding.look != Look())
    key += " look " + std::to_string(std::bit_cast<std::uint32_t>(encoding.look.exposure)) + '/' +
           std::to_string(static_cast<int>(encoding.look.tone_map));
  if (const auto& behind = encoding.background)
    for (const float channel : {behind->r, behind->g, behind->b})
      key += " over " + std::to_string(std::bit_cast<std::uint32_t>(channel));
  if (encoding.has_alpha) key += " alpha";
  if (const auto& sensor = encoding.sensor)
    key += " sensor " + std::to_string(std::bit_cast<std::uint32_t>(sensor->least)) + '/' +
           std::to_string(std::bit_cast<std::uint32_t>(sensor->greatest)) +
           (sensor->is_in_millimetres ? " in millimetres" : "");
  if (versions) {
    key += " tiles";
    for (const std::uint32_t version : *versions) key += ' ' + std::to_string(version);
  }
  return key;
}

std::string etag_of(const std::string& key) {
  return '"' + proto::content_hash(key + " tessera " TESSERA_VERSION) + '"';
}

EncodedImage encode_picture(const Picture& picture, const Film::Snapshot* so_far, const std::stop_token& unwanted) {
  auto encoded = encode(so_far ? so_far->pixels : picture.film->pixels(), picture.choice.plane, picture.choice.encoding,
                        so_far ? &so_far->is_there : nullptr, unwanted);
  if (encoded) {
    const auto* versions = so_far ? &so_far->versions : nullptr;
    return std::make_shared<const SentImage>(
        SentImage{*std::move(encoded), etag_of(key_of(picture.job, picture.choice, versions))});
  }
  if (unwanted.stop_requested()) throw proto::Abandoned();
  throw std::logic_error("an image was to be encoded that its format can't hold");
}

/// What there is of an image that isn't complete is copied to be encoded, as tiles go on to be stored.
EncodedImage encode_picture(JobTable& jobs, const Picture& picture, const std::stop_token& unwanted) {
  if (picture.complete) return encode_picture(picture, nullptr, unwanted);
  const std::set<Aov> aovs = aovs_of(picture.choice.plane, picture.film->pixels().aovs());
  const PixelRect& rect = picture.film->pixels().rect;
  const auto pixels = static_cast<std::uint64_t>(rect.area());
  const auto width = static_cast<std::uint64_t>(rect.width());
  const JobTable::CopyRoom room(jobs, Film::memory_bytes(width, pixels / width, aovs) + pixels, unwanted);
  const Film::Snapshot so_far = picture.film->snapshot(aovs);
  return encode_picture(picture, &so_far, unwanted);
}

}  // namespace

std::string picture_etag(const std::string& identity, const ImageChoice& choice) {
  return etag_of(key_of(identity, choice, nullptr));
}

bool is_known(const Request& request, const std::string& etag) {
  return covers(request.header("if-none-match").value_or(""), etag);
}

bool is_encoded(Services& services, const std::string& job, const ImageChoice& choice) {
  return services.images.find(key_of(job, choice, nullptr)).has_value();
}

proto::Problem gave_way() {
  return {ProblemCode::out_of_memory_budget,
          "The image gave way to those of others, each time it was rendered; send the request again when fewer are "
          "asked for, or have the server set more memory aside (--max-film-memory).",
          {}};
}

Response picture_response(Services& services, const Request& request, const JobView& job, const ImageChoice& choice,
                          const std::string& identity) {
  const bool complete = job.image == ImageState::complete || job.image == ImageState::gone;
  std::vector<std::uint32_t> versions;
  std::shared_ptr<const Film> film;
  if (!complete) {
    auto found = services.jobs.film(job.id);
    if (found && !*found) {  // It has been completed, and let go from memory, meanwhile.
      const auto now = services.jobs.find(job.id);
      return now ? picture_response(services, request, *now, choice, identity) : problem_response(now.problem());
    }
    if (!found) return problem_response(found.problem());
    film = *std::move(found);
    if (FileBudget::is_limited() && film->tile_count() > kQuickTiles) throw TooHeavy{};
    versions = film->versions();
  }
  const std::string key = key_of(job.id, choice, complete ? nullptr : &versions);
  const std::string etag = complete ? picture_etag(identity, choice) : etag_of(key);
  Response response;
  const bool has_address = request.method == "GET";
  response.headers = {{"ETag", etag},
                      {"Vary", "Accept"},
                      {"Cache-Control", !complete     ? "no-store"
                                        : has_address ? kForGood
                                                      : "no-cache"}};
  if (is_known(request, etag)) {
    response.status = 304;
    return response;
  }
  auto image = services.images.find(key);
  if (!image && FileBudget::is_limited() && !request.is_head) throw TooHeavy{};  // Encoding is for the slow lane.
  response.headers.emplace_back("Content-Type", choice.format.media_type);
  if (!image && request.is_head) {  // Its length isn't worth encoding it.
    response.has_length = false;
    if (complete) response.headers.emplace_back("Accept-Ranges", "bytes");
    return response;
  }
  if (!image && complete) {
    auto found = find_film(services, job.id);
    if (!found) return problem_response(found.problem());
    film = *std::move(found);
  }
  if (!image) {
    const Picture picture{job.id, std::move(film), complete, choice};
    const auto make = [&](const std::stop_token& unwanted) {
      EncodedImage made = encode_picture(services.jobs, picture, unwanted);
      spdlog::debug("job {}: encoded as {}", job.id, choice.format.name);
      // Of an image that goes on to grow, this will hardly be asked for again.
      const auto bytes = proto::has_ended(job.state) ? std::optional(made->bytes.size()) : std::nullopt;
      return ImageCache::Made{std::move(made), bytes};
    };
    image = services.images.get(key, make, request.abandoned);
  }
  if (!complete) response.headers.front().second = (*image)->etag;  // More may have been stored meanwhile.
  response.shared_body = {*image, &(*image)->bytes};
  if (complete && has_address) answer_range(request, response);
  return response;
}

Response fetch_image(Services& services, Request& request) {
  const auto job = find_job(services, request);
  if (!job) return problem_response(job.problem());
  const auto choice = choose_image(request, job->order->settings);
  if (!choice) return problem_response(choice.problem());
  if (job->image == ImageState::partial && !choice->partial)
    return problem_response(
        {ProblemCode::image_not_ready,
         "The job is " + std::string(proto::name(job->state)) + "; ?partial=1 gives the image so far.",
         {}});
  if (const auto film = services.jobs.film(job->id); !film) return problem_response(film.problem());
  return picture_response(services, request, *job, *choice, job->id);
}

}  // namespace tessera::server
