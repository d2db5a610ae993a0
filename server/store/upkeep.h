#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>

#include "server/store/blob_store.h"
#include "server/store/owners.h"
#include "server/store/scene_store.h"
#include "server/store/shelf.h"

namespace tessera::server {

/// What is done beside all requests, on a thread of its own: jobs and images go that are beyond their limits, and then
/// scenes and blobs, but for those that unfinished jobs, or stored scenes, need. The bytes of what goes are given back
/// to those who had it.
class Upkeep {
 public:
  struct Limits {
    Shelf::Limits blobs, scenes;
    std::function<void()> look_after_jobs = [] {};
  };
  /// Begins at once. The others live longer.
  Upkeep(BlobStore& blobs, SceneStore& scenes, Owners& owners, const Limits& limits);

  /// Removes what is beyond the limits now. For this thread, and tests.
  static void sweep(BlobStore& blobs, SceneStore& scenes, Owners& owners, const Limits& limits,
                    const std::stop_token& stop);

 private:
  void work_on(const std::stop_token& stop);

  BlobStore& blobs_;
  SceneStore& scenes_;
  Owners& owners_;
  const Limits limits_;
  std::mutex mutex_;
  std::condition_variable_any stopped_;
  std::jthread thread_;
};

}  // namespace tessera::server
