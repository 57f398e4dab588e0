// Reading of data files: MB/s on one core, beside a bare loop that finds lines with memchr and
// reads each number with std::from_chars, and keeps nothing but the sum.
//
//   data_file_benchmark [ROWS]

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <sstream>
#include <string>

#include "polyest/data_file.h"

namespace {

constexpr int kDefaultRows = 600'000;
constexpr int kRepetitions = 5;

// Returns a record of a time and four channels with six digits each.
std::string Record(int rows, char delimiter, char decimal) {
  std::string text = "t;x1;x2;x3;x4\n";
  char line[128];
  for (int row = 0; row < rows; ++row) {
    const double t = row * 0.001;
    const auto wave = [row](int k) { return ((row * 7919 + k * 104729) % 2'000'003) * 1e-6 - 1; };
    std::snprintf(line, sizeof line, "%.3f;%.6f;%.6f;%.6f;%.6f\n", t, wave(1), wave(2), wave(3),
                  wave(4));
    text += line;
  }
  for (char& c : text) {
    if (c == ';') c = delimiter;
    if (c == '.') c = decimal;
  }
  return text;
}

// Reads all numbers below the header; returns their sum.
double BareLoop(const std::string& text) {
  double sum = 0;
  const char* place = text.data();
  const char* const end = place + text.size();
  const auto line_end = [end](const char* from) {
    return static_cast<const char*>(std::memchr(from, '\n', static_cast<size_t>(end - from)));
  };
  for (place = line_end(place) + 1; place < end; ++place) {
    const char* const stop = line_end(place);
    while (place < stop) {
      double value = 0;
      place = std::from_chars(place, stop, value).ptr;
      sum += value;
      if (place < stop) ++place;
    }
  }
  return sum;
}

double Read(const std::string& text) {
  polyest::DataColumns columns;
  columns.measured = {"x1", "x2", "x3", "x4"};
  std::istringstream in(text);
  auto reader = polyest::DataReader::Open(in, "data.csv", columns);
  const auto data = reader->Read(std::numeric_limits<int64_t>::max());
  if (!data.ok()) {
    std::fprintf(stderr, "%s\n", data.status().ToString().c_str());
    std::exit(EXIT_FAILURE);
  }
  double sum = 0;
  for (const double t : data->time_s()) sum += t;
  for (const auto& channel : data->channels()) {
    for (const double value : channel.values()) sum += value;
  }
  return sum;
}

// Prints the best of some repetitions; returns MB/s.
double Measure(const char* name, const std::string& text, const std::function<double()>& read) {
  double best = std::numeric_limits<double>::infinity();
  double sum = 0;
  for (int i = 0; i < kRepetitions; ++i) {
    const auto start = std::chrono::steady_clock::now();
    sum = read();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    best = std::min(best, took.count());
  }
  const double speed = static_cast<double>(text.size()) / best / 1e6;
  std::printf("%-28s %7.0f MB/s   (sum %.6f)\n", name, speed, sum);
  return speed;
}

}  // namespace

int main(int argc, char** argv) {
  const int rows = argc > 1 ? std::atoi(argv[1]) : kDefaultRows;
  const std::string plain = Record(rows, ',', '.');
  const std::string german = Record(rows, ';', ',');
  std::string windows;
  for (const char c : plain) windows += c == '\n' ? "\r\n" : std::string(1, c);
  std::printf("%d rows, %.1f MB, best of %d\n", rows, static_cast<double>(plain.size()) / 1e6,
              kRepetitions);
  const double bare = Measure("bare memchr and from_chars", plain, [&] { return BareLoop(plain); });
  const double reader = Measure("commas, decimal point", plain, [&] { return Read(plain); });
  Measure("the same with CR LF", windows, [&] { return Read(windows); });
  Measure("semicolons, decimal comma", german, [&] { return Read(german); });
  std::printf("reader/bare                  %7.2f\n", reader / bare);
}
