#include "client/progress_bar.h"

#include <gtest/gtest.h>

namespace tessera::client {
namespace {

using proto::JobState;
using proto::JobStatus;

JobStatus rendering(double done, double all) {
  JobStatus status;
  status.state = JobState::rendering;
  status.progress = all == 0 ? 0 : done / all;
  return status;
}

/// What the bar writes to something that is no terminal.
std::string log_of(const std::vector<JobStatus>& statuses) {
  std::FILE* file = std::tmpfile();
  {
    ProgressBar bar(file);
    EXPECT_FALSE(bar.is_on_terminal());
    for (const JobStatus& status : statuses) bar.show(status, std::nullopt);
  }
  std::rewind(file);
  std::string text;
  for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) text += static_cast<char>(c);
  std::fclose(file);
  return text;
}

TEST(ProgressLine, ShowsWhatIsKnown) {
  JobStatus status = rendering(50, 200);
  EXPECT_EQ(progress_line(status, std::nullopt, 80), "rendering [#######.......................]  25%");
  status.eta = 75;
  EXPECT_EQ(progress_line(status, 12.345, 80),
            "rendering [#######.......................]  25%  ETA 1 min 15 s  12.35 Mray/s");
  EXPECT_EQ(progress_line(status, 12.345, 14), "rendering [###");
  EXPECT_EQ(progress_line(rendering(0, 0), std::nullopt, 80), "rendering [..............................]   0%");
}

TEST(ProgressLine, IsFullWhenTheJobIsCompleted) {
  JobStatus status = rendering(200, 200);
  status.state = JobState::completed;
  status.eta = 0;
  EXPECT_EQ(progress_line(status, std::nullopt, 80), "completed [##############################] 100%");
}

TEST(ProgressBar, WritesPlainLinesWhenNotOnATerminal) {
  JobStatus queued;
  JobStatus completed = rendering(100, 100);
  completed.state = JobState::completed;
  EXPECT_EQ(
      log_of({queued, queued, rendering(0, 100), rendering(9, 100), rendering(10, 100), rendering(55, 100), completed}),
      "queued\nrendering  0%\nrendering 10%\nrendering 50%\ncompleted\n");
}

TEST(FormatDuration, PicksItsUnits) {
  EXPECT_EQ(format_duration(0), "0 ms");
  EXPECT_EQ(format_duration(0.85), "850 ms");
  EXPECT_EQ(format_duration(0.9996), "1.0 s");
  EXPECT_EQ(format_duration(59.96), "1 min 00 s");
  EXPECT_EQ(format_duration(125), "2 min 05 s");
  EXPECT_EQ(format_duration(3725), "1 h 02 min");
}

TEST(FormatQuality, TellsTheErrorWhereItIsKnown) {
  proto::JobStatus status;
  EXPECT_EQ(format_quality(status), "");
  status.samples_per_pixel.mean = 148.25;
  status.achieved = {0.009718, {0.00918, 0.010299}};
  EXPECT_EQ(format_quality(status), ", 148.2 samples a pixel, error 0.00972 (0.00918 to 0.0103)");
}

}  // namespace
}  // namespace tessera::client
