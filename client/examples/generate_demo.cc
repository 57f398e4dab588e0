// Writes a demonstration record to the standard output: `generate_demo oscillator`.

#include <cstdio>
#include <string_view>
#include <utility>

#include "client/examples/demo_records.h"

namespace {

constexpr std::pair<std::string_view, void (*)()> kRecords[] = {
    {"oscillator", demo::WriteOscillator},  {"disturbed", demo::WriteDisturbed},
    {"warming", demo::WriteWarming},        {"rough_sensor", demo::WriteRoughSensor},
    {"releases", demo::WriteReleases},      {"specimens", demo::WriteSpecimens},
    {"roll_plane", demo::WriteRollPlane},   {"roll_plane_4dof", demo::WriteHalfCar},
    {"quarter_car", demo::WriteQuarterCar}, {"bicycle", demo::WriteBicycle},
    {"damper_rig", demo::WriteDamperRig},   {"chain", demo::WriteChain},
};

}  // namespace

int main(int argc, char** argv) {
  for (const auto& [name, write] : kRecords) {
    if (argc != 2 || name != argv[1]) continue;
    write();
    return 0;
  }
  std::fputs("usage: generate_demo RECORD, one of", stderr);
  for (const auto& [name, write] : kRecords) std::fprintf(stderr, " %s", name.data());
  std::fputs("\n", stderr);
  return 2;
}
