#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "core/math/vec2.h"
#include "core/sampling/dimensions.h"
#include "core/sampling/pixel_samples.h"
#include "core/sampling/sampler.h"

namespace tessera {

/// Takes a sampler's place where it is a template's argument, gives the same numbers, and remembers which dimensions
/// each sample has drawn. Copies, and the `Sample`s made by it, share one record. For one thread.
class RecordingSampler {
 public:
  class Sample {
   public:
    float one(Dimension dimension) const {
      record_->push_back(dimension.index);
      return sample_.one(dimension);
    }
    Vec2 two(Dimension dimension) const {
      record_->push_back(dimension.index);
      record_->push_back(dimension.index + 1);
      return sample_.two(dimension);
    }

   private:
    friend class RecordingSampler;
    Sample(PathSample sample, std::vector<std::uint32_t>& record) : sample_(sample), record_(&record) {}

    PathSample sample_;
    std::vector<std::uint32_t>* record_;
  };

  explicit RecordingSampler(const Sampler& sampler) : sampler_(sampler) {}

  Sample at(SampleId id) const { return {sampler_.at(id), (*records_)[{id.x, id.y, id.index}]}; }
  PixelOffset film(SampleId id) const {
    at(id).two(kFilmDimension);
    return sampler_.film(id);
  }
  float one(SampleId id, Dimension dimension) const { return at(id).one(dimension); }
  Vec2 two(SampleId id, Dimension dimension) const { return at(id).two(dimension); }

  /// How many samples have drawn it.
  std::size_t draws_of(Dimension dimension) const {
    return static_cast<std::size_t>(std::ranges::count_if(*records_, [&](const auto& of_sample) {
      return std::ranges::find(of_sample.second, dimension.index) != of_sample.second.end();
    }));
  }

  /// One line for each dimension that a sample has drawn more than once (STRESS 66: there are none).
  std::vector<std::string> repeats() const {
    std::vector<std::string> lines;
    for (const auto& [id, record] : *records_) {
      std::map<std::uint32_t, int> counts;
      for (const std::uint32_t dimension : record) ++counts[dimension];
      for (const auto& [dimension, count] : counts)
        if (count > 1)
          lines.push_back("sample " + std::to_string(std::get<2>(id)) + " of pixel (" +
                          std::to_string(std::get<0>(id)) + ", " + std::to_string(std::get<1>(id)) +
                          ") draws dimension " + std::to_string(dimension) + ' ' + std::to_string(count) + " times");
    }
    return lines;
  }

 private:
  using Records = std::map<std::tuple<std::int32_t, std::int32_t, std::uint32_t>, std::vector<std::uint32_t>>;

  Sampler sampler_;
  std::shared_ptr<Records> records_ = std::make_shared<Records>();
};

}  // namespace tessera
