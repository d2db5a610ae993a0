#include "server/http/multipart.h"

#include <string>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

constexpr const char* kType = "multipart/form-data; boundary=xyz";

/// What is made of a form, as text: "name|file name|type|content" of each part, or "malformed".
std::string parsed(std::string_view body, std::string_view content_type = kType) {
  const auto parts = parse_form(content_type, body);
  if (!parts) {
    EXPECT_EQ(parts.problem().code, proto::ProblemCode::malformed_request);
    return "malformed";
  }
  std::string text;
  for (const FormPart& part : *parts) {
    text += part.name + '|' + part.file_name.value_or("-") + '|' + part.content_type + '|';
    text += part.content;
    text += '\n';
  }
  return text;
}

std::string part(const std::string& disposition, const std::string& content = "abc") {
  return "--xyz\r\nContent-Disposition: " + disposition + "\r\n\r\n" + content + "\r\n--xyz--\r\n";
}

TEST(Multipart, HasPartsInTheirOrder) {
  const std::string body =
      "--xyz\r\nContent-Disposition: form-data; name=\"a\"\r\n\r\n1\r\n"
      "--xyz\r\ncontent-disposition:form-data; name=b; filename=\"c d.obj\"\r\nContent-Type: model/obj\r\n\r\nv\r\n\r\n"
      "\r\n--xyz--\r\n";
  const std::string expected = "a|-||1\nb|c d.obj|model/obj|v\r\n\r\n\n";
  EXPECT_EQ(parsed(body), expected);
  EXPECT_EQ(parsed("said before\r\n" + body + "said after\r\n--xyz\r\n"), expected) << "RFC 2046, 5.1.1";
  EXPECT_EQ(parsed(body, "Multipart/Form-Data; charset=utf-8; Boundary=\"xyz\""), expected);
  EXPECT_EQ(parsed("--xyz--\r\n"), "");
  EXPECT_EQ(parsed("--xyz--"), "");
}

TEST(Multipart, ContentIsAnyBytes) {
  const std::string all = [] {
    std::string bytes;
    for (int i = 0; i < 256; ++i) bytes += static_cast<char>(i);
    return bytes;
  }();
  for (const std::string& content :
       {all, std::string(), std::string("\r\n"), std::string("\r\n--xy"), std::string("\r\n--xyzz\r\n"),
        std::string("\r\n--xyz-\r\n"), std::string("\r\n--xyz--x\r\n"), std::string("\n--xyz--\n")})
    EXPECT_EQ(parsed(part("form-data; name=a", content)), "a|-||" + content + "\n");
}

TEST(Multipart, BoundariesMayBePadded) {
  EXPECT_EQ(parsed("--xyz \t\r\nContent-Disposition: form-data; name=a\r\n\r\nb\r\n--xyz-- \r\n"), "a|-||b\n");
}

TEST(Multipart, NamesOfFilesAreAsTheyWereSent) {
  const auto file_name = [](const std::string& quoted) {
    return parsed(part("form-data; name=a; filename=" + quoted));
  };
  EXPECT_EQ(file_name("\"a\\\"b\\\\c\""), "a|a\"b\\c||abc\n");
  EXPECT_EQ(file_name("\"C:\\x\\y.obj\""), "a|C:\\x\\y.obj||abc\n");
  EXPECT_EQ(file_name("\"a;b=c\""), "a|a;b=c||abc\n");
  EXPECT_EQ(file_name("\"\xC3\xA4%22\""), "a|\xC3\xA4%22||abc\n");
  EXPECT_EQ(file_name("\"\""), "a|||abc\n");
}

TEST(Multipart, NamesOfFilesMayBeEscaped) {
  const auto named = [](const std::string& how) { return parsed(part("form-data; name=a; " + how)); };
  EXPECT_EQ(named("filename*=UTF-8''na%C3%AFve%20b.obj"), "a|na\xC3\xAFve b.obj||abc\n");
  EXPECT_EQ(named("filename*=utf-8'en'b"), "a|b||abc\n");
  EXPECT_EQ(named("filename=c; filename*=utf-8''b"), "a|c||abc\n") << "the one that forms have";
}

TEST(Multipart, WhatIsNoFormIsRefused) {
  const std::string good = part("form-data; name=a");
  ASSERT_EQ(parsed(good), "a|-||abc\n");
  for (std::size_t size = 0; size < good.size() - 2; ++size)
    EXPECT_EQ(parsed(good.substr(0, size)), "malformed") << size;
  for (const char* type : {"multipart/form-data", "multipart/form-data; boundary=", "multipart/form-data; boundary=\"x",
                           "multipart/form-data; boundary=\"a\tb\"", "multipart/form-data; boundary=\"xyz \"",
                           "multipart/form-data; boundary=xyz; boundary=xyz", "multipart/form-data; =xyz",
                           "multipart/form-data; boundary", "multipart/form-data; boundary=xyz boundary=abc"})
    EXPECT_EQ(parsed(good, type), "malformed") << type;
  EXPECT_EQ(parsed(good, "multipart/form-data; boundary=" + std::string(71, 'x')), "malformed");
  for (const char* disposition : {"form-data",
                                  "attachment; name=a",
                                  "form-data; name=\"a",
                                  "form-data; name=a; name=b",
                                  "form-data; name",
                                  "form-data; name=\"a\"b",
                                  "form-data; name=a b",
                                  "form-data name=a",
                                  "form-data; name=a; filename*=b",
                                  "form-data; name=a; filename*=latin1''b",
                                  "form-data; name=a; filename*=utf-8''%FF",
                                  "form-data; name=a; filename*=utf-8''%0A",
                                  "form-data; name=a\r\nContent-Disposition: form-data; name=b",
                                  "form-data; name=a\r\nno header",
                                  "form-data; name=a\r\n folded: b",
                                  "form-data; name=a\r\nContent-Transfer-Encoding: base64",
                                  "form-data; name=a\r\nContent-Type: a/b\r\nContent-Type: a/b",
                                  "form-data; name=a\rb",
                                  "form-data; name=\"a\nb\"",
                                  "form-data; name=\"a\x01\""})
    EXPECT_EQ(parsed(part(disposition)), "malformed") << disposition;
  EXPECT_EQ(parsed("--xyz\r\n\r\nabc\r\n--xyz--"), "malformed") << "no disposition";
  EXPECT_EQ(parsed("--xyz\r\n--xyz--"), "malformed");
  EXPECT_EQ(parsed("--xyz\nContent-Disposition: form-data; name=a\n\nabc\n--xyz--\n"), "malformed")
      << "bare line feeds";
  EXPECT_EQ(parsed(part("form-data; name=a\r\nX: " + std::string(10000, 'x'))), "malformed");
}

TEST(Multipart, PartsAreFew) {
  std::string body;
  for (std::size_t i = 0; i <= kMostParts; ++i) {
    if (i == kMostParts) {
      EXPECT_NE(parsed(body + "--xyz--"), "malformed");
    }
    body += "--xyz\r\nContent-Disposition: form-data; name=a\r\n\r\n\r\n";
  }
  EXPECT_EQ(parsed(body + "--xyz--"), "malformed");
}

TEST(Multipart, WhatLooksLikeABoundaryTakesNoMoreTime) {
  std::string content;
  while (content.size() < 8 << 20) content += "\r\n--xyzz\r\n--xyz- \r\n--xyz--x";
  EXPECT_EQ(parsed(part("form-data; name=a", content)).size(), content.size() + 6);
}

}  // namespace
}  // namespace tessera::server
