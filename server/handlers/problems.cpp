#include <algorithm>
#include <string>

#include <nlohmann/json.hpp>

#include "proto/wire/problem.h"
#include "server/handlers/handlers.h"
#include "server/http/media_type.h"

namespace tessera::server {
namespace {

/// People look with a browser, which asks for HTML.
bool wants_html(const Request& request) {
  const auto accept = request.header("accept").value_or("*/*");
  return acceptance(accept, "text/html") > acceptance(accept, "application/json");
}

nlohmann::json to_json(const proto::ProblemEntry& row) {
  return {{"type", "/problems/" + std::string(row.name)},
          {"code", row.name},
          {"status", row.status},
          {"title", row.title},
          {"help", row.help}};
}

std::string in_html(std::string_view text) {
  std::string out;
  for (const char c : text) out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

std::string to_html(const proto::ProblemEntry& row) {
  return "<h1><a href=\"/problems/" + in_html(row.name) + "\">" + std::to_string(row.status) + ' ' + in_html(row.name) +
         "</a></h1>\n<p><b>" + in_html(row.title) + ".</b> " + in_html(row.help) + "</p>\n";
}

Response html_response(const std::string& content) {
  return {200,
          {{"Content-Type", "text/html; charset=utf-8"}, {"Vary", "Accept"}},
          "<!DOCTYPE html>\n<meta charset=\"utf-8\">\n<title>Problems of Tessera</title>\n" + content};
}

Response varying_json_response(const nlohmann::json& body) {
  Response response = json_response(200, body);
  response.headers.emplace_back("Vary", "Accept");
  return response;
}

}  // namespace

Response list_problems(Services&, Request& request) {
  std::string html;
  nlohmann::json list = nlohmann::json::array();
  for (const proto::ProblemEntry& row : proto::problem_table()) {
    html += to_html(row);
    list.push_back(to_json(row));
  }
  return wants_html(request) ? html_response(html) : varying_json_response({{"problems", list}});
}

Response show_problem(Services&, Request& request) {
  const auto table = proto::problem_table();
  const auto row = std::ranges::find(table, request.parameter, &proto::ProblemEntry::name);
  if (row == table.end())
    return problem_response({proto::ProblemCode::not_found, "There is no such problem; GET /problems/ lists all.", {}});
  return wants_html(request) ? html_response(to_html(*row)) : varying_json_response(to_json(*row));
}

}  // namespace tessera::server
