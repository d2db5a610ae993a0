#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/columns.h"
#include "client/commands/commands.h"
#include "client/progress_bar.h"

namespace tessera::client {
namespace {

struct List {
  std::vector<std::string> states;
  std::size_t limit = std::numeric_limits<std::size_t>::max();

  std::vector<proto::JobStatus> choose(std::vector<proto::JobStatus> jobs) const {
    std::erase_if(jobs, [&](const proto::JobStatus& job) {
      return !states.empty() && std::ranges::find(states, proto::name(job.state)) == states.end();
    });
    if (jobs.size() > limit) jobs.erase(jobs.begin(), jobs.end() - static_cast<std::ptrdiff_t>(limit));
    return jobs;
  }
};

std::vector<std::string> state_names() {
  std::vector<std::string> names;
  for (auto state = proto::JobState::queued;; state = static_cast<proto::JobState>(static_cast<int>(state) + 1)) {
    names.emplace_back(proto::name(state));
    if (state == proto::JobState::canceled) return names;
  }
}

void print_table(Session& session, const std::vector<proto::JobStatus>& jobs) {
  std::size_t width = 2;
  for (const proto::JobStatus& job : jobs) width = std::max(width, columns_of(job.id));
  const auto print_row = [&](const std::string& id, std::string_view state, const std::string& done,
                             const std::string& size, const std::string& time, const std::string& name) {
    session.print(padded(id, width) + "  " + padded(state, 9) + "  " + flush_right(done, 4) + "  " +
                  flush_right(size, 11) + "  " + flush_right(time, 12) + "  " + name);
  };
  print_row("ID", "STATE", "DONE", "SIZE", "TIME", "NAME");
  for (const proto::JobStatus& job : jobs)
    print_row(job.id, proto::name(job.state), std::to_string(static_cast<int>(fraction_done(job) * 100)) + '%',
              std::to_string(job.width) + 'x' + std::to_string(job.height), format_duration(job.elapsed), job.name);
}

nlohmann::json to_json(const std::vector<proto::JobStatus>& jobs) {
  nlohmann::json list = nlohmann::json::array();
  for (const proto::JobStatus& job : jobs) list.push_back(proto::to_json(job));
  return list;
}

}  // namespace

void add_list(CLI::App& tool, Session& session) {
  CLI::App* command = tool.add_subcommand("list", "List the server's jobs, the latest last");
  const auto list = std::make_shared<List>();
  command->add_option("--state", list->states, "Only jobs in this state; several with commas")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(state_names()));
  command->add_option("--limit", list->limit, "At most so many, the latest")->check(CLI::Range(1, 1'000'000));
  command->callback([list, &session] {
    const auto jobs = list->choose(session.client().list());
    session.json ? session.print_json(to_json(jobs)) : print_table(session, jobs);
  });
}

}  // namespace tessera::client
