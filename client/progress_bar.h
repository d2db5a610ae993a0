#pragma once

#include <cstddef>
#include <cstdio>
#include <optional>
#include <string>

#include "proto/wire/job_status.h"

namespace tessera::client {

/// "850 ms", "12.3 s", "2 min 05 s", "1 h 02 min".
std::string format_duration(double seconds);

/// ", 148 samples a pixel, error 0.00972 (0.00918 to 0.0103)" of a job whose error is known; else nothing.
std::string format_quality(const proto::JobStatus& status);

/// How much of a job is rendered, 0..1.
double fraction_done(const proto::JobStatus& status);

/// One line of at most `columns` characters: state, bar, percent, time left, speed as far as they are known.
std::string progress_line(const proto::JobStatus& status, std::optional<double> mrays_per_second, std::size_t columns);

/// Shows a job's progress: on a terminal one line that is drawn over, elsewhere a plain line for each new state and
/// each ten percent. One thread at a time.
class ProgressBar {
 public:
  explicit ProgressBar(std::FILE* out);

  /// Ends the line that is drawn over, if there is one.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  bool is_on_terminal() const { return is_on_terminal_; }

  void show(const proto::JobStatus& status, std::optional<double> mrays_per_second);

 private:
  void draw_over(const std::string& line);

  std::FILE* out_;
  bool is_on_terminal_;
  bool has_drawn_ = false;
  std::string last_line_;
};

}  // namespace tessera::client
