#pragma once

#include <filesystem>

#include <gtest/gtest.h>

#include "tests/support/shared_data.h"

namespace tessera {

/// Tests that want the data beside the checkout.
class SharedDataTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto found = shared_data();
    if (!found) GTEST_SKIP() << "the shared data is missing: set TESSERA_SHARED_DATA";
    data_ = *found;
  }

  std::filesystem::path data_;
};

}  // namespace tessera
