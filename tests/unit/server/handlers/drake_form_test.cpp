#include "server/handlers/drake_form.h"

#include <map>
#include <string>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using Fields = std::map<std::string, std::string>;

/// As Drake writes numbers: std::to_string.
Fields label_fields() {
  return {{"scene", "{}"},           {"scene_sha256", std::string(64, 'A')},
          {"image_type", "label"},   {"width", "640"},
          {"height", "480"},         {"near", "0.010000"},
          {"far", "10.000000"},      {"focal_x", "579.411255"},
          {"focal_y", "579.500000"}, {"fov_x", "1.009136"},
          {"fov_y", "0.785398"},     {"center_x", "319.500000"},
          {"center_y", "0.000000"},  {"submit", "Render"}};
}

Fields depth_fields() {
  Fields fields = label_fields();
  fields["image_type"] = "depth";
  fields["min_depth"] = "0.250000";
  fields["max_depth"] = "5.000000";
  return fields;
}

std::string body_of(const Fields& fields) {
  std::string body;
  for (const auto& [name, value] : fields)
    body += "--b\r\nContent-Disposition: form-data; name=\"" + name + "\"\r\n\r\n" + value + "\r\n";
  return body + "--b--\r\n";
}

proto::Result<DrakeForm> read(const std::string& body, const std::string& query = "") {
  Request request;
  request.headers["content-type"] = "multipart/form-data; boundary=b";
  request.target = parse_target("/render?" + query).value();
  return read_drake_form(request, body);
}

/// The fields that a form is refused for.
std::string refused(const Fields& fields, const std::string& query = "") {
  const std::string body = body_of(fields);
  const auto form = read(body, query);
  if (form) return "";
  EXPECT_EQ(form.problem().code, proto::ProblemCode::malformed_request);
  std::string names;
  for (const proto::FieldError& error : form.problem().errors) names += (names.empty() ? "" : " ") + error.pointer;
  return names;
}

std::string refused_with(Fields fields, const std::string& name, const std::string& value) {
  fields[name] = value;
  return refused(fields);
}

TEST(DrakeForm, HasWhatWasSent) {
  const std::string body = body_of(depth_fields());
  const auto form = read(body);
  ASSERT_TRUE(form);
  EXPECT_EQ(form->scene, "{}");
  EXPECT_EQ(form->scene_sha256, "sha256:" + std::string(64, 'a'));
  EXPECT_EQ(form->image_type, DrakeImage::depth);
  EXPECT_EQ(form->width, 640U);
  EXPECT_EQ(form->height, 480U);
  EXPECT_EQ(form->clipping.near, 0.01F);
  EXPECT_EQ(form->clipping.far, 10.0F);
  EXPECT_EQ(form->intrinsics.fx, 579.411255F);
  EXPECT_EQ(form->intrinsics.fy, 579.5F);
  EXPECT_EQ(form->sensor.least, 0.25F);
  EXPECT_EQ(form->sensor.greatest, 5.0F);
}

TEST(DrakeForm, CountsPixelsFromTheirMiddles) {
  const std::string body = body_of(label_fields());
  const auto form = read(body);
  ASSERT_TRUE(form);
  EXPECT_EQ(form->intrinsics.cx, 320.0F);
  EXPECT_EQ(form->intrinsics.cy, 0.5F);
}

TEST(DrakeForm, WantsEveryField) {
  for (const auto& [name, value] : depth_fields()) {
    Fields fields = depth_fields();
    fields.erase(name);
    EXPECT_EQ(refused(fields), name == "submit" ? "" : name);
  }
  EXPECT_EQ(refused({}).substr(0, 31), "scene scene_sha256 image_type w");
}

TEST(DrakeForm, WantsNoOther) {
  EXPECT_EQ(refused_with(label_fields(), "fov", "1"), "fov");
  EXPECT_EQ(refused_with(label_fields(), "Width", "1"), "Width");
  std::string twice = body_of(label_fields());
  twice.insert(twice.size() - 7, "--b\r\nContent-Disposition: form-data; name=\"far\"\r\n\r\n9\r\n");
  const auto form = read(twice);
  ASSERT_FALSE(form);
  EXPECT_EQ(form.problem().errors.at(0).pointer, "far");
}

TEST(DrakeForm, WantsNumbers) {
  for (const char* name : {"near", "far", "focal_x", "focal_y", "fov_x", "fov_y", "center_x", "center_y", "min_depth",
                           "max_depth", "width", "height"})
    for (const char* value : {"", "x", "1x", "nan", "1,5", "0x1", "1 2"})
      EXPECT_EQ(refused_with(depth_fields(), name, value), name) << value;
  for (const char* name : {"width", "height"})
    for (const char* value : {"0", "-1", "1.5", "4294967296"})
      EXPECT_EQ(refused_with(label_fields(), name, value), name) << value;
  for (const char* name : {"focal_x", "focal_y", "fov_x", "fov_y"})
    for (const char* value : {"0", "-1", "inf", "-0"})
      EXPECT_EQ(refused_with(label_fields(), name, value), name) << value;
  EXPECT_EQ(refused_with(label_fields(), "center_x", "-40.25"), "");
}

TEST(DrakeForm, WantsRangesInOrder) {
  EXPECT_EQ(refused_with(depth_fields(), "near", "10"), "near");
  EXPECT_EQ(refused_with(depth_fields(), "near", "-1"), "near");
  EXPECT_EQ(refused_with(depth_fields(), "far", "inf"), "");
  EXPECT_EQ(refused_with(depth_fields(), "min_depth", "5"), "min_depth");
  EXPECT_EQ(refused_with(depth_fields(), "max_depth", "inf"), "");
  EXPECT_EQ(refused_with(label_fields(), "min_depth", "1"), "max_depth");
}

TEST(DrakeForm, ComesAsAsked) {
  struct Case {
    Fields fields;
    const char* query;
    ImageFormat format;
    bool is_in_millimetres;
  };
  const Case cases[] = {{depth_fields(), "", ImageFormat::tiff, false},
                        {depth_fields(), "depth=float&format=tiff", ImageFormat::tiff, false},
                        {depth_fields(), "depth=uint16", ImageFormat::png, true},
                        {depth_fields(), "depth=uint16&format=tiff", ImageFormat::tiff, true},
                        {label_fields(), "format=png", ImageFormat::png, false}};
  for (const Case& c : cases) {
    const std::string body = body_of(c.fields);
    const auto form = read(body, c.query);
    ASSERT_TRUE(form) << c.query;
    EXPECT_EQ(form->format, c.format) << c.query;
    EXPECT_EQ(form->sensor.is_in_millimetres, c.is_in_millimetres) << c.query;
  }
  EXPECT_EQ(refused(depth_fields(), "format=png"), "?format");
  EXPECT_EQ(refused(label_fields(), "format=tiff"), "?format");
  EXPECT_EQ(refused(label_fields(), "depth=uint16"), "?depth");
  EXPECT_EQ(refused(label_fields(), "samples=4"), "?samples");
  EXPECT_EQ(refused_with(label_fields(), "image_type", "colour"), "image_type");
}

}  // namespace
}  // namespace tessera::server
