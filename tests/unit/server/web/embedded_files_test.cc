// Tests server/web/embedded_files.cmake: the folder beside this file is in this program.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "server/web/web_page.h"

namespace polyest::internal {
namespace {

TEST(EmbeddedFiles, AreThoseOfTheFolderByteByByte) {
  std::vector<std::string> paths;
  for (const WebFile& file : EmbeddedFiles()) {
    paths.emplace_back(file.path);
    std::ifstream in(POLYEST_SOURCE_DIR "/tests/unit/server/web/page" + std::string(file.path),
                     std::ios::binary);
    ASSERT_TRUE(in) << file.path;
    std::ostringstream content;
    content << in.rdbuf();
    EXPECT_EQ(file.bytes, content.str()) << file.path;
  }
  EXPECT_THAT(paths,
              ::testing::ElementsAre("/assets/bytes.png", "/assets/empty.css", "/index.html"));
}

TEST(EmbeddedFiles, HaveTheirContentTypes) {
  EXPECT_EQ(FileAnswer(EmbeddedFiles(), "/").content_type, "text/html; charset=utf-8");
  EXPECT_EQ(FileAnswer(EmbeddedFiles(), "/assets/bytes.png").content_type, "image/png");
  EXPECT_EQ(FileAnswer(EmbeddedFiles(), "/assets/empty.css").content_type,
            "text/css; charset=utf-8");
}

}  // namespace
}  // namespace polyest::internal
