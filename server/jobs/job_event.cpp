#include "server/jobs/job_event.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/accel/accel_table.h"
#include "proto/read_accel.h"
#include "server/handlers/accel_json.h"
#include "server/store/stored_json.h"

namespace tessera::server {
namespace {

using nlohmann::json;

/// A whole number of a struct, by the name that it has in the journal.
template <typename T>
struct Whole {
  const char* name;
  std::uint64_t T::*member;
};
constexpr Whole<RayCounts> kRayNumbers[] = {{"camera", &RayCounts::camera},
                                            {"camera_hits", &RayCounts::camera_hits},
                                            {"reflection", &RayCounts::reflection},
                                            {"refraction", &RayCounts::refraction},
                                            {"shadow", &RayCounts::shadow},
                                            {"scattered", &RayCounts::scattered},
                                            {"camera_skipped", &RayCounts::camera_skipped}};
constexpr Whole<TestCounts> kTestNumbers[] = {{"volume_tests", &TestCounts::volume_tests},
                                              {"volume_hits", &TestCounts::volume_hits},
                                              {"object_tests", &TestCounts::object_tests},
                                              {"object_hits", &TestCounts::object_hits},
                                              {"false_hits", &TestCounts::false_hits}};
constexpr Whole<PlanReport> kPlanNumbers[] = {{"tiles", &PlanReport::tiles},
                                              {"tiles_empty", &PlanReport::tiles_empty},
                                              {"tiles_with_candidates", &PlanReport::tiles_with_candidates},
                                              {"smallest_tile", &PlanReport::smallest_tile},
                                              {"largest_tile", &PlanReport::largest_tile},
                                              {"objects", &PlanReport::objects},
                                              {"objects_on_screen", &PlanReport::objects_on_screen},
                                              {"primitives", &PlanReport::primitives},
                                              {"camera_rays", &PlanReport::camera_rays}};
constexpr Whole<AccelStats> kStructureNumbers[] = {{"bytes", &AccelStats::bytes},
                                                   {"nodes", &AccelStats::nodes},
                                                   {"leaves", &AccelStats::leaves},
                                                   {"meshes", &AccelStats::meshes},
                                                   {"meshes_ready", &AccelStats::meshes_ready},
                                                   {"meshes_loaded", &AccelStats::meshes_loaded}};

template <typename T, std::size_t kCount>
json numbers_json(const T& from, const Whole<T> (&numbers)[kCount]) {
  json values = json::object();
  for (const auto& [name, member] : numbers) values[name] = from.*member;
  return values;
}

template <typename T, std::size_t kCount>
void read_numbers(const json& values, const Whole<T> (&numbers)[kCount], T& out) {
  for (const auto& [name, member] : numbers)
    out.*member = stored_number<std::remove_reference_t<decltype(out.*member)>>(values.at(name));
}

/// JSON has no infinity.
json real_json(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }
double read_real(const json& value) {
  return value.is_null() ? std::numeric_limits<double>::infinity() : value.get<double>();
}

/// Of what has been going on since computers have clocks, and goes on for a while: sums of two can be told in
/// nanoseconds.
constexpr std::chrono::years kLongest{100};

double in_seconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}
std::chrono::steady_clock::duration read_duration(const json& value) {
  const std::chrono::duration<double> duration(value.get<double>());
  if (!(duration >= -kLongest && duration <= kLongest)) throw std::runtime_error("nothing lasts so long");
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(duration);
}

constexpr std::array<std::string_view, 3> kEndedBy{"samples", "error", "seconds"};

json structure_options_json(const AccelOptions& options) {
  json values = accel_options_json(options);
  values["kind"] = accel_name(options.kind);
  return values;
}

AccelOptions read_structure_options(const json& value) {
  const std::string text = value.dump();
  proto::FieldErrors errors{std::stop_token()};
  const auto document = proto::JsonDocument::parse(text, proto::Limits().max_depth, errors);
  AccelOptions options;
  if (document) proto::read_accel(proto::JsonCursor(*document, errors), options);
  if (!document || !errors.empty()) throw std::runtime_error("a structure's options can't be read: " + text);
  return options;
}

json structure_use_json(const std::optional<StructureUse>& use) {
  if (!use) return nullptr;
  json value = numbers_json(use->stats, kStructureNumbers);
  value["depth"] = use->stats.depth;
  value["mesh_seconds"] = use->stats.mesh_seconds;
  value["options"] = structure_options_json(use->options);
  value["build_seconds"] = use->build_seconds;
  value["shared"] = use->shared;
  return value;
}

std::optional<StructureUse> read_structure_use(const json& value) {
  if (value.is_null()) return std::nullopt;
  StructureUse use{read_structure_options(value.at("options")), {}, value.at("build_seconds"), value.at("shared")};
  read_numbers(value, kStructureNumbers, use.stats);
  use.stats.depth = stored_number<std::uint32_t>(value.at("depth"));
  use.stats.mesh_seconds = value.at("mesh_seconds");
  return use;
}

json plan_report_json(const PlanReport& plan) {
  json value = numbers_json(plan, kPlanNumbers);
  value["accel"] = structure_options_json(plan.accel);
  value["accel_because"] = plan.accel_because;
  value["needs_structure"] = plan.needs_structure;
  json& candidates = value["candidates"] = json::array();
  for (const AccelEstimate& estimate : plan.candidates)
    candidates.push_back({{"options", structure_options_json(estimate.options)},
                          {"build_seconds", real_json(estimate.build_seconds)},
                          {"trace_seconds", real_json(estimate.trace_seconds)}});
  json& skips = value["skips"] = json::array();
  for (const Skip& skip : plan.skips)
    skips.push_back({{"what", skip.what}, {"because", skip.because}, {"count", skip.count}});
  return value;
}

PlanReport read_plan_report(const json& value) {
  PlanReport plan{};
  read_numbers(value, kPlanNumbers, plan);
  plan.accel = read_structure_options(value.at("accel"));
  plan.accel_because = value.at("accel_because");
  plan.needs_structure = value.at("needs_structure");
  for (const json& estimate : value.at("candidates"))
    plan.candidates.push_back({read_structure_options(estimate.at("options")), read_real(estimate.at("build_seconds")),
                               read_real(estimate.at("trace_seconds"))});
  for (const json& skip : value.at("skips"))
    plan.skips.push_back({skip.at("what"), skip.at("because"), stored_number<std::uint64_t>(skip.at("count"))});
  return plan;
}

json passes_json(const PassReport& passes) {
  json value{{"passes", passes.passes},
             {"least", passes.least},
             {"most", passes.most},
             {"samples", passes.samples},
             {"low_total", passes.low_total},
             {"high_total", passes.high_total},
             {"error", nullptr},
             {"ended_by", nullptr}};
  if (const auto& error = passes.error)
    value["error"] = {real_json(error->error), real_json(error->low), real_json(error->high)};
  if (passes.ended_by) value["ended_by"] = kEndedBy[static_cast<std::size_t>(*passes.ended_by)];
  return value;
}

PassReport read_passes(const json& value) {
  PassReport passes{stored_number<std::uint32_t>(value.at("passes")),
                    stored_number<std::uint32_t>(value.at("least")),
                    stored_number<std::uint32_t>(value.at("most")),
                    stored_number<std::uint64_t>(value.at("samples")),
                    stored_number<std::uint64_t>(value.at("low_total")),
                    stored_number<std::uint64_t>(value.at("high_total")),
                    {},
                    {}};
  if (const json& error = value.at("error"); !error.is_null())
    passes.error = ErrorEstimate{read_real(error.at(0)), read_real(error.at(1)), read_real(error.at(2))};
  if (const json& by = value.at("ended_by"); !by.is_null()) {
    const auto found = std::ranges::find(kEndedBy, by.get<std::string>());
    if (found == kEndedBy.end()) throw std::runtime_error("nothing ends by " + by.dump());
    passes.ended_by = static_cast<EndedBy>(found - kEndedBy.begin());
  }
  return passes;
}

json figures_json(const JobFigures& figures) {
  return {{"rays", numbers_json(figures.rays, kRayNumbers)},
          {"tests", numbers_json(figures.tests, kTestNumbers)},
          {"samples", figures.samples},
          {"tiles", figures.tiles},
          {"broken_textures", figures.broken_textures},
          {"passes", passes_json(figures.passes)},
          {"core_seconds", {figures.cores.busy, figures.cores.idle}}};
}

JobFigures figures_of(const json& value) {
  JobFigures figures;
  read_numbers(value.at("rays"), kRayNumbers, figures.rays);
  read_numbers(value.at("tests"), kTestNumbers, figures.tests);
  figures.samples = stored_number<std::uint64_t>(value.at("samples"));
  figures.tiles = stored_number<std::uint64_t>(value.at("tiles"));
  figures.broken_textures = stored_number<std::uint64_t>(value.at("broken_textures"));
  figures.passes = read_passes(value.at("passes"));
  if (const auto cores = value.find("core_seconds"); cores != value.end()) figures.cores = {cores->at(0), cores->at(1)};
  return figures;
}

json order_json(const JobOrder& order) {
  json value{
      {"order", json::parse(order.document)}, {"warnings", order.warnings}, {"parsing", in_seconds(order.parsing)}};
  value["memory"] = {{"of", order.need.shared_key}, {"shared", order.need.shared_bytes}, {"own", order.need.own_bytes}};
  if (!order.owner.empty()) value["owner"] = order.owner;
  if (order.retry) value["idempotency"] = {{"key", order.retry->key}, {"request", order.retry->request}};
  return value;
}

/// A job's document that names its scene by hash names no files.
class NoFilesOfOrders : public proto::FileSource {
 public:
  proto::Result<proto::SourceFile> blob(const proto::ContentHash&, const std::stop_token&) const override {
    return proto::Problem();
  }
  proto::Result<proto::SourceFile> asset(std::string_view, const std::stop_token&) const override {
    return proto::Problem();
  }
  const proto::AssetReader& reader() const override { return proto::direct_reader(); }  // There is nothing to read.
};

JobOrder read_order(const json& value) {
  JobOrder order{};
  order.document = value.at("order").dump();
  auto job = read_order_document(order.document);
  if (!job) throw std::runtime_error("an order can't be read: " + job.problem().detail);
  order.name = std::move(job->name);
  order.scene_hash = std::get<proto::ContentHash>(job->scene);
  order.settings = std::move(job->settings);
  order.priority = job->priority;
  order.webhook = std::move(job->webhook);
  order.warnings = stored_number<std::uint64_t>(value.at("warnings"));
  order.parsing = read_duration(value.at("parsing"));
  order.owner = value.value("owner", "");
  const json& memory = value.at("memory");
  order.need = {memory.at("of"), stored_number<std::uint64_t>(memory.at("shared")),
                stored_number<std::uint64_t>(memory.at("own"))};
  if (const auto retry = value.find("idempotency"); retry != value.end())
    order.retry = RetryKey{retry->at("key"), retry->at("request")};
  return order;
}

/// What an event has to tell beside when it was.
struct EventBody {
  json operator()(const JobEvent::Queued& queued) const { return order_json(*queued.order); }
  json operator()(const JobEvent::QueuedAgain&) const { return json::object(); }
  json operator()(const JobEvent::Preparing&) const { return json::object(); }
  json operator()(const JobEvent::Planned& planned) const { return {{"plan", plan_report_json(*planned.plan)}}; }
  json operator()(const JobEvent::Rendering& rendering) const {
    return {{"structure", structure_use_json(rendering.structure)}};
  }
  json operator()(const JobEvent::Ended& ended) const {
    json value = figures_json(ended.figures);
    value["structure"] = structure_use_json(ended.structure);
    value["image"] = ended.has_image;
    value["never_tested"] = ended.tested ? ended.tested->unmarked() : ended.never_tested;
    if (!ended.error.empty()) value["error"] = ended.error;
    return value;
  }
  json operator()(const JobEvent::ImageGone&) const { return json::object(); }
  json operator()(const JobEvent::WebhookTried& tried) const {
    json value{{"state", proto::name(tried.state)}};
    if (!tried.error.empty()) value["error"] = tried.error;
    if (tried.state == proto::WebhookState::pending) value["delay"] = in_seconds(tried.delay);
    return value;
  }
  json operator()(const JobEvent::Removed& removed) const {
    return removed.owner.empty() ? json::object() : json{{"owner", removed.owner}};
  }
};

struct EventKind {
  std::string_view operator()(const JobEvent::Queued&) const { return "queued"; }
  std::string_view operator()(const JobEvent::QueuedAgain&) const { return "queued"; }
  std::string_view operator()(const JobEvent::Preparing&) const { return "preparing"; }
  std::string_view operator()(const JobEvent::Planned&) const { return "planned"; }
  std::string_view operator()(const JobEvent::Rendering&) const { return "rendering"; }
  std::string_view operator()(const JobEvent::Ended& ended) const { return proto::name(ended.state); }
  std::string_view operator()(const JobEvent::ImageGone&) const { return "image_gone"; }
  std::string_view operator()(const JobEvent::WebhookTried&) const { return "webhook"; }
  std::string_view operator()(const JobEvent::Removed& removed) const {
    return removed.expired ? "expired" : "removed";
  }
};

struct EventStep {
  std::optional<JobStep> operator()(const JobEvent::Queued&) const { return JobStep::queued; }
  std::optional<JobStep> operator()(const JobEvent::QueuedAgain&) const { return JobStep::queued; }
  std::optional<JobStep> operator()(const JobEvent::Preparing&) const { return JobStep::preparing; }
  std::optional<JobStep> operator()(const JobEvent::Planned&) const { return std::nullopt; }
  std::optional<JobStep> operator()(const JobEvent::Rendering&) const { return JobStep::rendering; }
  std::optional<JobStep> operator()(const JobEvent::Ended&) const { return JobStep::ended; }
  std::optional<JobStep> operator()(const JobEvent::ImageGone&) const { return std::nullopt; }
  std::optional<JobStep> operator()(const JobEvent::WebhookTried&) const { return std::nullopt; }
  std::optional<JobStep> operator()(const JobEvent::Removed&) const { return std::nullopt; }
};

JobEvent::WebhookTried read_webhook_tried(const json& body) {
  const auto state = proto::webhook_state(body.at("state").get<std::string>());
  if (!state) throw std::runtime_error("a webhook can't be in that state: " + body.dump());
  JobEvent::WebhookTried tried{*state, body.value("error", "")};
  if (const auto delay = body.find("delay"); delay != body.end()) tried.delay = read_duration(*delay);
  return tried;
}

decltype(JobEvent::what) read_what(std::string_view kind, const json& body) {
  if (kind == "queued" && body.contains("order"))
    return JobEvent::Queued{std::make_shared<const JobOrder>(read_order(body))};
  if (kind == "queued") return JobEvent::QueuedAgain{};
  if (kind == "preparing") return JobEvent::Preparing{};
  if (kind == "planned")
    return JobEvent::Planned{std::make_shared<const PlanReport>(read_plan_report(body.at("plan")))};
  if (kind == "rendering") return JobEvent::Rendering{read_structure_use(body.at("structure"))};
  if (kind == "image_gone") return JobEvent::ImageGone{};
  if (kind == "webhook") return read_webhook_tried(body);
  if (kind == "removed" || kind == "expired")
    return JobEvent::Removed{.expired = kind == "expired", .owner = body.value("owner", "")};
  const auto state = proto::job_state(kind);
  if (!state || !proto::has_ended(*state)) throw std::runtime_error("no event is called " + std::string(kind));
  return JobEvent::Ended{*state,
                         body.value("error", ""),
                         read_structure_use(body.at("structure")),
                         body.value("image", false),
                         figures_of(body),
                         nullptr,
                         stored_number<std::uint64_t>(body.at("never_tested"))};
}

}  // namespace

proto::Result<proto::JobRequest> read_order_document(std::string_view document) {
  proto::Limits any;
  any.max_pixels = any.max_tiles = 1ULL << 44;  // Of which the bytes can be told in 64 bits.
  any.max_samples = std::numeric_limits<std::uint64_t>::max();
  return proto::parse_job(document, NoFilesOfOrders(), any);
}

std::string text_of(const JobFigures& figures) { return figures_json(figures).dump(); }

JobFigures read_figures(const std::string& text) { return figures_of(parse_stored(text)); }

std::string_view kind_of(const JobEvent& event) { return std::visit(EventKind{}, event.what); }

std::string body_of(const JobEvent& event) {
  json body = std::visit(EventBody{}, event.what);
  body["age"] = in_seconds(event.age);
  return body.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::optional<JobStep> step_of(const JobEvent& event) { return std::visit(EventStep{}, event.what); }

JobEvent read_event(const JournalEntry& entry) {
  if (entry.time < std::chrono::system_clock::time_point()) throw std::runtime_error("it happened before 1970");
  const json body = parse_stored(entry.body);
  return {entry.time, read_duration(body.at("age")), read_what(entry.kind, body)};
}

}  // namespace tessera::server
