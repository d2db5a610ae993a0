#pragma once

#include <atomic>
#include <cstdint>

namespace tessera::server {

struct Config;
class BlobStore;
class KeyRing;
class KnownJobs;
struct Connections;
class ImageCache;
class Owners;
class Quotas;
class SceneStore;
class Scheduler;
class StructureCache;
class JobTable;
class JobRunner;
class JobStarter;
class Ledger;
class Isolation;
class Journal;
class ImageStore;

/// What handlers work with. Everything in it is safe to use from any number of threads.
struct Services {
  const Config& config;
  KeyRing& keys;
  Owners& owners;
  Quotas& quotas;
  BlobStore& blobs;
  SceneStore& scenes;
  JobTable& jobs;
  KnownJobs& known_jobs;
  ImageCache& images;
  JobRunner& runner;
  Ledger& ledger;
  JobStarter& starter;
  Scheduler& scheduler;
  StructureCache& structures;
  Journal& journal;
  ImageStore& films;
  const Isolation& isolation;
  const Connections* connections = nullptr;        ///< Once there are any.
  std::atomic<std::uint32_t> most_connections{0};  ///< At once.
  std::atomic<std::uint64_t> least_free_disk{0};   ///< With less the server isn't ready.
  std::atomic<bool> draining{false};               ///< No jobs are taken any more; those that there are go on.
  std::atomic<bool> shutting_down{false};          ///< Nothing goes on.
};

}  // namespace tessera::server
