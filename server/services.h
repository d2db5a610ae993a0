#pragma once

#include <atomic>

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
  Scheduler& scheduler;
  StructureCache& structures;
  const Connections* connections = nullptr;  ///< Once there are any.
  std::atomic<bool> shutting_down{false};
};

}  // namespace tessera::server
