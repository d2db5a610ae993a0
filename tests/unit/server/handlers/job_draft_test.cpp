#include "server/handlers/job_draft.h"

#include <algorithm>
#include <cstring>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tessera::server {
namespace {

using nlohmann::json;

const proto::ContentHash kHash = "sha256:" + std::string(64, 'a');

Asset model(proto::FileFormat format = proto::FileFormat::obj) {
  Asset asset;
  asset.format = format;
  asset.name = "body";
  asset.hash = kHash;
  return asset;
}

Asset document(AssetKind kind, std::string_view text) {
  Asset asset = model();
  asset.kind = kind;
  asset.document = text;
  return asset;
}

/// As it stands in a query.
std::string encoded(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += '%';
    for (const int digit : {c >> 4, c & 15}) out += "0123456789ABCDEF"[digit];
  }
  return out;
}

proto::Result<JobDraft> draft(const Asset& asset, const std::string& query = "") {
  Request request;
  request.target = *parse_target("/?" + query);
  return draft_job(request, asset);
}

json job_of(const Asset& asset, const std::string& query = "") { return json::parse(draft(asset, query)->job); }
json scene_of(const Asset& asset, const std::string& query = "") { return json::parse(draft(asset, query)->scene); }

std::string refused(const Asset& asset, const std::string& query) {
  const auto drafted = draft(asset, query);
  if (drafted) return "";
  std::string places;
  for (const proto::FieldError& error : drafted.problem().errors) places += error.pointer;
  return places;
}

TEST(JobDraft, AModelIsLitPlacedAndFramed) {
  const json scene = scene_of(model());
  EXPECT_EQ(scene["objects"], (json{{{"type", "file"}, {"blob", kHash}, {"format", "obj"}}}));
  EXPECT_EQ(scene["lights"][0]["preset"], "studio");
  EXPECT_EQ(scene["lights"][0]["only_without_lights"], true);
  EXPECT_EQ(scene["ground"], "shadow");
  const json job = job_of(model());
  EXPECT_EQ(job["image"], (json{{"width", 512}, {"height", 512}}));
  EXPECT_EQ(job["settings"]["until"], (json{{"error", 0.02}, {"samples", 256}}));
  EXPECT_EQ(job["settings"]["transparent"], true);
  EXPECT_FALSE(job["camera"].contains("from"));
}

TEST(JobDraft, TheCameraLooksFromWhereItIsAsked) {
  const auto camera = [](const std::string& query) { return job_of(model(), query)["camera"]; };
  EXPECT_EQ(camera("azimuth=-90&elevation=0&fov=20"),
            (json{{"type", "perspective"}, {"azimuth", -90}, {"elevation", 0}, {"fov", 20}}));
  EXPECT_EQ(camera("azimuth=5"), (json{{"type", "perspective"}, {"azimuth", 5}, {"elevation", 20}, {"fov", 30}}));
}

TEST(JobDraft, TheQuerySaysWhatIsNotTheDefault) {
  EXPECT_EQ(job_of(model(), "width=3")["image"], (json{{"width", 3}, {"height", 3}}));
  EXPECT_EQ(job_of(model(), "height=3&width=4")["image"], (json{{"width", 4}, {"height", 3}}));
  EXPECT_EQ(job_of(model(), "samples=7")["settings"]["until"], (json{{"samples", 7}}));
  EXPECT_EQ(job_of(model(), "error=0.5&seconds=2")["settings"]["until"], (json{{"error", 0.5}, {"seconds", 2}}));
  EXPECT_TRUE(draft(model(), "seconds=2")->is_timed);
  EXPECT_FALSE(draft(model(), "error=2")->is_timed);
  EXPECT_EQ(job_of(model(), "aov=depth")["settings"]["aovs"], json{"depth"});
  const json all = job_of(model(), "aov=all")["settings"]["aovs"];
  for (const char* aov : {"depth", "normal", "object_id", "albedo", "base_color", "alpha", "variance"})
    EXPECT_EQ(std::ranges::count(all, aov), 1) << aov;
  EXPECT_EQ(std::ranges::count(all, "cost_volumes"), 0) << "counting takes long";
  EXPECT_EQ(job_of(model(), "background=environment")["settings"]["transparent"], false);
  EXPECT_FALSE(job_of(model(), "camera=1").contains("camera"));
  EXPECT_EQ(scene_of(model(), "camera=1")["objects"][0]["file_camera"], 1);
  EXPECT_EQ(scene_of(model(), "camera=front%201")["objects"][0]["file_camera"], "front 1");
  EXPECT_EQ(scene_of(model(), "variant=red&smooth=30")["objects"][0]["variant"], "red");
  EXPECT_FALSE(scene_of(model(), "ground=none").contains("ground"));
  EXPECT_EQ(scene_of(model(), "up=z")["objects"][0]["transform"], (json{1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0}));
}

TEST(JobDraft, AnEnvironmentIsOneOfManyThings) {
  const auto light = [](const std::string& asked) { return scene_of(model(), "environment=" + asked)["lights"]; };
  EXPECT_EQ(light("studio"), (json{{{"type", "environment"}, {"preset", "studio"}}}));
  EXPECT_EQ(light("0.5")[0]["radiance"], (json{0.5, 0.5, 0.5}));
  EXPECT_EQ(light("1,0.5,2")[0]["radiance"], (json{1, 0.5, 2}));
  EXPECT_EQ(light("ff0000")[0]["radiance"], (json{1.0, 0.0, 0.0}));
  EXPECT_EQ(light(kHash)[0]["blob"], kHash);
  for (const char* bad :
       {"", "1,2", "x", "-1", "1,2,3,4", "[1]", "null", "sha256:1", "1,2,\"3\"", "1]", "[1,2,3", "1e30"})
    EXPECT_EQ(refused(model(), "environment=" + encoded(bad)), "?environment") << bad;
}

TEST(JobDraft, WhatIsNoValueIsRefusedByName) {
  for (const std::string name :
       {"width", "height", "samples", "error", "seconds", "azimuth", "elevation", "fov", "smooth"})
    for (const char* bad : {"", "x", "-1000", "1e999", "nan", "[1]", "1 2", "\"1\""})
      EXPECT_EQ(refused(model(), name + '=' + encoded(bad)), '?' + name) << bad;
  for (const char* bad : {"error=0", "error=1e-60", "error=1e300", "seconds=0", "fov=0", "fov=180", "azimuth=360.1"})
    EXPECT_EQ(refused(model(), bad), '?' + std::string(bad, std::strchr(bad, '='))) << bad;
  EXPECT_EQ(refused(model(), "up=x&ground=grass"), "?up?ground");
  EXPECT_EQ(refused(model(), "camera=1&fov=3"), "?fov");
}

TEST(JobDraft, ADocumentIsAsItIsWithWhatItDoesNotSay) {
  const Asset scene = document(AssetKind::scene_document, R"({"objects":[]})");
  EXPECT_EQ(draft(scene)->scene, scene.document);
  EXPECT_EQ(job_of(scene), (json{{"settings", {{"until", {{"error", 0.02}, {"samples", 256}}}}}}));
  EXPECT_TRUE(job_of(scene, "fov=20").contains("camera"));
  EXPECT_EQ(refused(document(AssetKind::scene_document, R"({"camera":{}})"), "fov=20&ground=none"), "?ground?fov");

  const Asset job = document(AssetKind::job_document, R"({"scene":{"objects":[]},"settings":{"seed":1,"samples":2}})");
  EXPECT_EQ(job_of(job, "background=ffffff&width=2"),
            json::parse(R"({"scene":{"objects":[]},"settings":{"seed":1,"samples":2,"transparent":true},
                            "image":{"width":2,"height":2}})"));
  EXPECT_EQ(refused(job, "samples=2"), "?samples");
  EXPECT_EQ(refused(job, "up=z"), "?up");
  EXPECT_TRUE(draft(document(AssetKind::job_document, R"({"scene":1,"settings":{"until":{"seconds":1}}})"))->is_timed);
  EXPECT_EQ(job_of(document(AssetKind::job_document, R"({"scene":1})"))["settings"]["until"]["samples"], 256);
  EXPECT_TRUE(draft(document(AssetKind::scene_document, R"({"objects":[{"path":"a"}]})"))->names_paths);
}

TEST(JobDraft, KeysTellWhatIsDifferent) {
  const auto key = [](const Asset& asset, const std::string& query) { return draft(asset, query)->key; };
  EXPECT_EQ(key(model(), ""), key(model(), "width=512&azimuth=30"));
  EXPECT_EQ(key(model(), "format=jpeg&exposure=2"), key(model(), ""));
  EXPECT_NE(key(model(), "azimuth=31"), key(model(), ""));
  EXPECT_EQ(draft(model(), "azimuth=31")->scene_key, draft(model(), "")->scene_key);
  EXPECT_NE(draft(model(), "up=z")->scene_key, draft(model(), "")->scene_key);
  EXPECT_NE(key(document(AssetKind::scene_document, "{}"), ""), key(document(AssetKind::job_document, "{}"), ""));
  Asset with_library = model();
  with_library.companions = {{"a.mtl", kHash}};
  EXPECT_NE(key(with_library, ""), key(model(), ""));
}

TEST(JobDraft, ProblemsAreToldInTermsOfTheRequest) {
  const proto::Problem scene{
      proto::ProblemCode::invalid_document,
      "",
      {{kHash + ":3", "Of " + kHash + " line 3."}, {"/objects/0/variant", "x"}, {"/objects/0", "y"}}};
  const proto::Problem told = scene_problem(scene, model());
  EXPECT_EQ(told.errors[0].pointer, "body:3");
  EXPECT_EQ(told.errors[0].detail, "Of body line 3.");
  EXPECT_EQ(told.errors[1].pointer, "?variant");
  EXPECT_EQ(told.errors[2].pointer, "body");
  EXPECT_EQ(scene_problem(scene, document(AssetKind::scene_document, "{}")).errors[1].pointer, "/objects/0/variant");
  const proto::Problem job{proto::ProblemCode::invalid_document, "", {{"/image", "x"}, {"/settings/until/error", "y"}}};
  EXPECT_EQ(job_problem(job, model()).errors[0].pointer, "?width");
  EXPECT_EQ(job_problem(job, model()).errors[1].pointer, "?error");
  EXPECT_EQ(job_problem(job, document(AssetKind::job_document, "{}")).errors[0].pointer, "/image");
}

}  // namespace
}  // namespace tessera::server
