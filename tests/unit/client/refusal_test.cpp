#include "client/refusal.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tessera::client {
namespace {

using nlohmann::json;

Failure refused(const proto::Problem& problem, std::string retry_after = {}) {
  const auto status = static_cast<unsigned>(proto::entry(problem.code).status);
  return refusal({status, std::move(retry_after), to_json(problem).dump()});
}

std::string message_of(proto::ProblemCode code, const std::string& detail) {
  return refused({code, detail, {}}).what();
}

TEST(Refusal, SpeaksOfOptionsWhereTheServerSpeaksOfRequests) {
  using enum proto::ProblemCode;
  EXPECT_EQ(message_of(image_not_ready, "The job is rendering; ?partial=1 gives the image so far."),
            "The image is not ready: The job is rendering; --partial fetches the image so far");
  EXPECT_EQ(message_of(not_found, "There is no job with this id; GET /v1/jobs lists all."),
            "There is no job with this id; 'tessera list' lists all");
  EXPECT_EQ(message_of(not_found, "The job didn't record depth; ask for it in /settings/aovs when you submit it."),
            "The job didn't record depth; submit it with --aov");
  EXPECT_EQ(message_of(not_acceptable, "This image comes as png (image/png), exr (image/x-exr)."),
            "The image doesn't come so: This image comes as png, exr.");
  EXPECT_EQ(message_of(hash_mismatch, "The bytes received are a, not b; send the file whose hash is in the path."),
            "The file changed while it was sent; try again");
  EXPECT_EQ(message_of(job_still_active, "The job is queued; cancel it first."),
            "The job has not ended: The job is queued; cancel it first.");
}

TEST(Refusal, NamesOptionsForParameters) {
  const Failure failure = refused({proto::ProblemCode::malformed_request,
                                   "The query parameters can't be used; `errors` says why.",
                                   {{"?aov", "There is no such AOV; known: depth."},
                                    {"?tone_map", "Only the colour has this; leave it or aov out."},
                                    {"/scene", "There is no blob x; upload it first with PUT /v1/blobs/x."}}});
  EXPECT_STREQ(failure.what(), "The server can't do what was asked");
  ASSERT_EQ(failure.errors().size(), 3U);
  EXPECT_EQ(failure.errors()[0].pointer, "--aov");
  EXPECT_EQ(failure.errors()[0].detail, "There is no such AOV; known: depth.");
  EXPECT_EQ(failure.errors()[1].pointer, "--tone-map");
  EXPECT_EQ(failure.errors()[2].pointer, "/scene");
  EXPECT_EQ(failure.errors()[2].detail, "There is no blob x; name the file by its path");
  EXPECT_EQ(failure.code(), "malformed_request");
}

TEST(Refusal, SaysWhenToTryAgain) {
  EXPECT_STREQ(refused({proto::ProblemCode::too_many_jobs, "5 jobs haven't ended.", {}}, "2").what(),
               "Too many jobs are waiting: 5 jobs haven't ended. (try again in 2 s)");
}

TEST(Refusal, NoneOfItsTitlesSpeaksOfHttp) {
  for (const proto::ProblemEntry& row : proto::problem_table()) {
    const std::string message = message_of(row.code, "Why.");
    for (const char* word : {"resource", "body", "request", "representation", "media type", "method"})
      EXPECT_EQ(message.find(word), std::string::npos) << message;
  }
}

TEST(Refusal, DoesWithoutAProblem) {
  for (const char* body : {"", "<html>", "[]", "{}", R"({"title": 3, "errors": 4})", R"({"errors": [1, {}]})"})
    EXPECT_STREQ(refusal({404, "", body}).what(), "The server refuses, with status 404; is this a Tessera server?")
        << body;
}

}  // namespace
}  // namespace tessera::client
