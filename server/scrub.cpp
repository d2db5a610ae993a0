#include "server/scrub.h"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <optional>
#include <ostream>
#include <set>
#include <stdexcept>
#include <string>
#include <variant>

#include <spdlog/spdlog.h>

#include "server/jobs/job_event.h"
#include "server/store/blob_store.h"
#include "server/store/data_folder.h"
#include "server/store/image_store.h"
#include "server/store/journal.h"
#include "server/store/journal_check.h"
#include "server/store/scene_store.h"
#include "server/store/wide_store.h"

namespace tessera::server {

namespace {

/// The jobs of which the journal says what they are.
std::set<std::string> accepted_jobs(const Journal& journal) {
  constexpr std::size_t kAtOnce = 1000;
  std::set<std::string> jobs;
  std::uint64_t last = 0;
  for (auto entries = journal.since(last, kAtOnce); !entries.empty(); entries = journal.since(last, kAtOnce)) {
    last = entries.back().seq;
    for (const JournalEntry& entry : entries) {
      try {
        if (std::holds_alternative<JobEvent::Queued>(read_event(entry).what)) jobs.insert(entry.job);
      } catch (const std::exception&) {  // A daemon leaves it out.
      }
    }
  }
  return jobs;
}

}  // namespace

int scrub(const Config& config, std::ostream& out, std::ostream& errors) {
  spdlog::set_level(spdlog::level::off);  // What it would say is said here.
  Shelf::Scrubbed sum;
  const auto is_damaged = [&](const std::filesystem::path& file) {
    out << "damaged, and set aside: " << file.string() << std::endl;
  };
  const auto add = [&](const Shelf::Scrubbed& part) {
    sum.files += part.files;
    sum.bytes += part.bytes;
    sum.damaged += part.damaged;
  };
  try {
    for (const std::filesystem::path& needed : {config.data_dir, config.structure_dir.value_or(config.data_dir)})
      if (!std::filesystem::is_directory(needed)) throw std::runtime_error("there is no folder " + needed.string());
    const DataFolder folder(config.data_dir);
    BlobStore blobs(folder.blobs(), folder.set_aside(), std::nullopt, proto::direct_reader());
    SceneStore scenes(folder.scenes(), folder.set_aside(), blobs, config.documents, 0);
    add(blobs.shelf().scrub(is_damaged));
    add(scenes.shelf().scrub(is_damaged));
    const auto missing = folder.has_traces_of_jobs() ? Journal::Missing::is_lost : Journal::Missing::is_new;
    const JournalCheck check = check_journal(folder.journal(), missing, folder.set_aside());
    add({1, check.bytes, check.damage.empty() ? 0U : 1U});
    if (!check.damage.empty()) {
      is_damaged(folder.journal());
      out << "what is wrong with it: " << check.damage << "\na new one has the " << check.entries << " entries and "
          << check.images << " images that could be read" << std::endl;
    }
    const Journal journal(folder.journal());
    const ImageStore images(folder.images(), folder.set_aside(), journal);
    // Each time, as a scrub that made a new journal may have ended then, and a daemon removes them.
    for (const auto& file : images.set_strangers_aside(accepted_jobs(journal)))
      out << "of a job that isn't known any more, and set aside: " << file.string() << std::endl;
    add(images.scrub(is_damaged));
    if (config.structure_dir)
      add(WideStore(*config.structure_dir, folder.set_aside(), config.max_structure_dir, 1).scrub(is_damaged));
  } catch (const std::exception& error) {
    errors << error.what() << std::endl;
    return 2;
  }
  out << sum.files << " files of " << sum.bytes << " bytes checked, " << sum.damaged << " damaged" << std::endl;
  return sum.damaged == 0 ? 0 : 1;
}

}  // namespace tessera::server
