#include "server/scrub.h"

#include <cstdint>
#include <exception>
#include <filesystem>
#include <optional>
#include <ostream>
#include <stdexcept>

#include <spdlog/spdlog.h>

#include "server/store/blob_store.h"
#include "server/store/data_folder.h"
#include "server/store/image_store.h"
#include "server/store/journal.h"
#include "server/store/scene_store.h"
#include "server/store/wide_store.h"

namespace tessera::server {

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
    const Journal journal(folder.journal());
    add(ImageStore(folder.images(), folder.set_aside(), journal).scrub(is_damaged));
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
