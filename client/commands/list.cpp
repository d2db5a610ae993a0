#include <cstdio>
#include <iostream>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/progress_bar.h"

namespace tessera::client {
namespace {

void print_table(const std::vector<proto::JobStatus>& jobs) {
  std::size_t id_width = 2;
  for (const proto::JobStatus& job : jobs) id_width = std::max(id_width, job.id.size());
  const int width = static_cast<int>(id_width);

  std::printf("%-*s  %-9s  %4s  %11s  %12s  %s\n", width, "ID", "STATE", "DONE", "SIZE", "TIME", "NAME");
  for (const proto::JobStatus& job : jobs) {
    const std::string size = std::to_string(job.width) + "x" + std::to_string(job.height);
    std::printf("%-*s  %-9s  %3d%%  %11s  %12s  %s\n", width, job.id.c_str(),
                std::string(proto::name(job.state)).c_str(), static_cast<int>(fraction_done(job) * 100), size.c_str(),
                format_duration(job.elapsed).c_str(), job.name.c_str());
  }
}

void print_json(const std::vector<proto::JobStatus>& jobs) {
  nlohmann::json list = nlohmann::json::array();
  for (const proto::JobStatus& job : jobs) list.push_back(proto::to_json(job));
  std::cout << list.dump(2) << "\n";
}

}  // namespace

void add_list(CLI::App& tool, Session& session) {
  CLI::App* command = tool.add_subcommand("list", "List the server's jobs");
  command->callback([&session] {
    const auto jobs = session.client().list();
    session.json ? print_json(jobs) : print_table(jobs);
  });
}

}  // namespace tessera::client
