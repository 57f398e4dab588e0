#include "server/web/web_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/web/web_answers.h"

namespace polyest::internal {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Pair;

constexpr WebFile kFiles[] = {
    {"/index.html", "text/html; charset=utf-8", "<p>page"},
    {"/assets/index-B0xYk3_a.js", "text/javascript; charset=utf-8", "1"},
    {"/assets/plain.css", "text/css; charset=utf-8", "p{}"},
};

std::string CacheControl(const HttpAnswer& answer) {
  for (const auto& [name, value] : Secured(answer).headers) {
    if (name == "Cache-Control") return value;
  }
  return "";
}

TEST(WebPage, IsServedWithItsFiles) {
  const HttpAnswer page = FileAnswer(kFiles, "/");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.body, "<p>page");
  EXPECT_EQ(page.content_type, "text/html; charset=utf-8");
  EXPECT_EQ(FileAnswer(kFiles, "/assets/plain.css").body, "p{}");
  for (const char* path : {"/assets", "/assets/", "/../index.html", "/index.html/", "/x", ""}) {
    EXPECT_EQ(FileAnswer(kFiles, path).status, 404) << path;
  }
}

TEST(WebPage, IsKeptByBrowsersWhereItsNameHasAHashOnly) {
  EXPECT_EQ(CacheControl(FileAnswer(kFiles, "/")), "no-store");
  EXPECT_EQ(CacheControl(FileAnswer(kFiles, "/assets/plain.css")), "no-store");
  EXPECT_EQ(CacheControl(FileAnswer(kFiles, "/assets/index-B0xYk3_a.js")),
            "public, max-age=31536000, immutable");
  EXPECT_EQ(CacheControl(FileAnswer(kFiles, "/none")), "no-store");
}

TEST(WebPage, SaysThatItIsMissing) {
  const HttpAnswer page = FileAnswer({}, "/");
  EXPECT_EQ(page.status, 200);
  EXPECT_THAT(page.body, HasSubstr("without the live page"));
}

TEST(WebPage, LetsBrowsersLoadAndEmbedNothingForeign) {
  const HttpAnswer page = Secured(FileAnswer(kFiles, "/"));
  EXPECT_THAT(page.headers, Contains(Pair("X-Content-Type-Options", "nosniff")));
  EXPECT_THAT(page.headers, Contains(Pair("Referrer-Policy", "no-referrer")));
  EXPECT_THAT(
      page.headers,
      Contains(Pair("Content-Security-Policy",
                    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' "
                    "data: blob:; connect-src 'self'; font-src 'self'; base-uri 'none'; "
                    "frame-ancestors 'none'; form-action 'none'")));
}

TEST(WebPage, IsInTheProgramWholeIfAtAll) {
  for (const WebFile& file : EmbeddedFiles()) {
    EXPECT_TRUE(file.path == "/index.html" || file.path.starts_with("/assets/")) << file.path;
    EXPECT_FALSE(file.bytes.empty()) << file.path;
  }
  EXPECT_TRUE(EmbeddedFiles().empty() || FileAnswer(EmbeddedFiles(), "/index.html").status == 200);
}

}  // namespace
}  // namespace polyest::internal
