// Tests that the guide describes every diagnostic.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <string>

#include "polyest/v1/estimate.pb.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

// Returns the text of each section, by its heading.
std::map<std::string, std::string> SectionsOfTheGuide() {
  std::map<std::string, std::string> sections;
  std::ifstream guide(std::string(POLYEST_SOURCE_DIR) + "/client/diagnostics.md");
  std::string heading;
  for (std::string line; std::getline(guide, line);) {
    if (line.starts_with("## ")) heading = line.substr(3);
    sections[heading] += line + "\n";
  }
  return sections;
}

TEST(DiagnosticGuide, SaysOfEveryCodeWhatItMeansHowItIsDecidedAndWhatToDo) {
  const std::map<std::string, std::string> sections = SectionsOfTheGuide();
  const auto& codes = *v1::Diagnostic::Code_descriptor();
  ASSERT_GT(codes.value_count(), 1);
  for (int i = 0; i < codes.value_count(); ++i) {
    if (codes.value(i)->number() == v1::Diagnostic::CODE_UNSPECIFIED) continue;
    const std::string& name = codes.value(i)->name();
    const auto section = sections.find(name);
    ASSERT_NE(section, sections.end()) << name << " has no section in client/diagnostics.md";
    EXPECT_THAT(section->second, HasSubstr("**Meaning.**")) << name;
    EXPECT_THAT(section->second, HasSubstr("**How it is decided")) << name;
    EXPECT_THAT(section->second, HasSubstr("hat to do")) << name;
  }
}

TEST(DiagnosticGuide, IsSummarizedInTheGuideOfTheCommand) {
  std::ifstream guide(std::string(POLYEST_SOURCE_DIR) + "/client/README.md");
  const std::string text(std::istreambuf_iterator<char>(guide), {});
  const auto& codes = *v1::Diagnostic::Code_descriptor();
  for (int i = 0; i < codes.value_count(); ++i) {
    if (codes.value(i)->number() == v1::Diagnostic::CODE_UNSPECIFIED) continue;
    EXPECT_THAT(text, HasSubstr("| `" + codes.value(i)->name() + "` |"));
  }
}

}  // namespace
}  // namespace polyest::internal
