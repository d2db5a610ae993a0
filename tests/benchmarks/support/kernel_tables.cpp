#include "tests/benchmarks/support/kernel_tables.h"

#include <cstdio>

#include "tests/benchmarks/support/bar_chart.h"

namespace tessera::bench {
namespace {

constexpr const char* kTimes = "×";

std::size_t at(int threads) { return static_cast<std::size_t>(threads - 1); }
std::string suffix(int threads) { return threads == 2 ? "_2t" : ""; }
std::string ratio(double value) { return value > 0 ? fixed(value, 2) + kTimes : "-"; }

std::string differing(const Disagreement& d) { return std::to_string(d.hit_or_miss) + " + " + std::to_string(d.t); }

void print_races(const std::vector<Race>& races, const std::vector<int>& threads) {
  std::vector<std::vector<std::string>> rows = {
      {"Mray/s", "threads", "million rays", "ours", "Embree", "ours / Embree", "its mode", "≠ default", "≠ robust"}};
  for (const Race& race : races)
    for (const int n : threads) {
      const Race::Peer* best = race.best(n);
      const bool is_first = n == threads.front();
      rows.push_back({race.rays, std::to_string(n), fixed(1e-6 * static_cast<double>(race.count), 2),
                      with_spread(race.mrays[at(n)]), best ? with_spread(best->mrays[at(n)]) : "-",
                      best ? with_spread(best->our_ratio[at(n)], 2) : "-", best ? name(best->mode) : "-",
                      best && is_first ? differing(race.from_default) : "",
                      best && is_first ? differing(race.from_robust) : ""});
    }
  print_table(rows);
}

void print_builds(const BuildRace& builds, const std::vector<int>& threads) {
  const auto peer = [&](const std::string& name) {
    const auto found = builds.peers.find(name);
    return found == builds.peers.end() ? BuildRace::Side() : found->second;
  };
  std::vector<std::vector<std::string>> rows = {
      {"Mtris/s", "threads", "ours", "Embree medium", "high", "ours / medium", "ours / high"}};
  for (const int n : threads)
    rows.push_back({"build", std::to_string(n), with_spread(builds.ours.mtris[at(n)]),
                    with_spread(peer("medium").mtris[at(n)]), with_spread(peer("high").mtris[at(n)]),
                    ratio(builds.our_ratio("medium", n)), ratio(builds.our_ratio("high", n))});
  print_table(rows);
}

void print_bytes(const SceneFigures& figures) {
  const auto per_triangle = [&](const BuildRace::Side& side) {
    return fixed(static_cast<double>(side.bytes) / static_cast<double>(figures.triangles), 1);
  };
  std::printf("bytes per triangle: ours %s", per_triangle(figures.builds->ours).c_str());
  for (const auto& [name, side] : figures.builds->peers)
    std::printf(", Embree %s %s", name.c_str(), per_triangle(side).c_str());
  std::printf("\n");
}

/// Fast builds are worth comparing where what they build is traced as fast.
void print_traced_speed(const SceneFigures& figures) {
  for (const Race& race : figures.races)
    if (race.rays == "diffuse" && !race.peers.empty() && !race.mrays[0].empty())
      std::printf("traced by diffuse rays, Mray/s: ours %s, Embree medium %s, high %s\n",
                  three_digits(race.mrays[0].median()).c_str(),
                  three_digits(race.mrays_in(EmbreeScenes::normal)).c_str(),
                  three_digits(race.mrays_in(EmbreeScenes::high)).c_str());
}

nlohmann::json to_json(const Disagreement& d) { return {{"hit_or_miss", d.hit_or_miss}, {"t", d.t}}; }

nlohmann::json to_json(const std::array<Samples, 2>& by_threads) {
  return {{"one_thread", by_threads[0].to_json()}, {"two_threads", by_threads[1].to_json()}};
}

nlohmann::json to_json(const Race& race) {
  nlohmann::json json = {{"rays", race.count}, {"mrays", to_json(race.mrays)}};
  if (race.peers.empty()) return json;
  json["differ_from_embree"] = {{"default", to_json(race.from_default)}, {"robust", to_json(race.from_robust)}};
  for (const Race::Peer& peer : race.peers)
    json["embree"].push_back({{"mode", name(peer.mode)},
                              {"calibrated_mrays", peer.calibrated_mrays},
                              {"mrays", to_json(peer.mrays)},
                              {"ours_over_it", to_json(peer.our_ratio)}});
  return json;
}

nlohmann::json to_json(const BuildRace& builds) {
  const auto side = [](const BuildRace::Side& s) {
    return nlohmann::json{{"mtris", to_json(s.mtris)}, {"bytes", s.bytes}};
  };
  nlohmann::json json = {{"ours", side(builds.ours)}};
  for (const auto& [name, peer] : builds.peers) json["embree"][name] = side(peer);
  return json;
}

void add_bars(const SceneFigures& figures, const std::vector<int>& threads, Report& to) {
  for (const Race& race : figures.races)
    for (const int n : threads)
      if (const Race::Peer* best = race.best(n))
        to.at_least(race.rays + "_" + figures.scene + suffix(n), best->our_ratio[at(n)].median(),
                    race.rays == "first_level" ? 1.5 : 1);
  if (!figures.builds || figures.builds->peers.empty()) return;
  for (const int n : threads)
    to.at_least("build_" + figures.scene + suffix(n), figures.builds->our_ratio("medium", n), 1);
  to.at_least(
      "bytes_" + figures.scene,
      static_cast<double>(figures.builds->peers.at("medium").bytes) / static_cast<double>(figures.builds->ours.bytes),
      1);
}

}  // namespace

void print(const SceneFigures& figures, const std::vector<int>& threads) {
  std::printf("\n%s: %zu triangles; %s\n", figures.scene.c_str(), figures.triangles, figures.structure.c_str());
  if (!figures.races.empty()) print_races(figures.races, threads);
  if (!figures.builds) return;
  print_builds(*figures.builds, threads);
  print_traced_speed(figures);
  print_bytes(figures);
  std::fflush(stdout);
}

void print(const std::vector<LeakCount>& leaks) {
  const auto count = [](std::optional<std::size_t> n) { return n ? std::to_string(*n) : "-"; };
  std::vector<std::vector<std::string>> rows = {{"leaks", "aimed at", "rays", "ours", "Embree", "Embree robust"}};
  for (const LeakCount& l : leaks)
    rows.push_back({l.mesh, l.aimed_at, std::to_string(l.rays), std::to_string(l.ours), count(l.embree_default),
                    count(l.embree_robust)});
  print_table(rows);
}

void report(const SceneFigures& figures, const std::vector<int>& threads, Report& to) {
  auto& json = to.figures()["scenes"][figures.scene];
  json = {{"triangles", figures.triangles}, {"structure", figures.structure}};
  for (const Race& race : figures.races) json["rays"][race.rays] = to_json(race);
  if (figures.builds) json["build"] = to_json(*figures.builds);
  add_bars(figures, threads, to);
}

void report(const std::vector<LeakCount>& leaks, Report& to) {
  std::size_t ours = 0;
  for (const LeakCount& l : leaks) {
    ours += l.ours;
    auto& json = to.figures()["leaks"].emplace_back();
    json = {{"mesh", l.mesh}, {"aimed_at", l.aimed_at}, {"rays", l.rays}, {"ours", l.ours}};
    if (l.embree_default) json["embree"] = {{"default", *l.embree_default}, {"robust", *l.embree_robust}};
  }
  to.at_most("leaks_ours", static_cast<double>(ours), 0);
}

std::string speed_chart(const SceneFigures& figures, const std::vector<int>& threads) {
  std::vector<BarGroup> groups;
  for (const Race& race : figures.races)
    for (const int n : threads) {
      const Race::Peer* best = race.best(n);
      groups.push_back(
          {race.rays + " × " + std::to_string(n), {race.mrays[at(n)], best ? best->mrays[at(n)] : Samples()}});
    }
  return bar_chart("Tracing " + figures.scene + ": kinds of rays × threads", "Mray/s",
                   {"Tessera", "Embree's best mode"}, groups);
}

}  // namespace tessera::bench
