#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace polyest::internal {

// Returns whether the text is well-formed XML, for the elements and attributes that our writer
// makes: every tag is closed in order, and every '<' and '&' in text and attributes is markup.
inline testing::AssertionResult IsWellFormed(const std::string& text) {
  std::vector<std::string> open;
  size_t elements = 0;
  for (size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at)) {
    const size_t end = text.find('>', at);
    if (end == std::string::npos) return testing::AssertionFailure() << "tag not ended";
    const std::string tag = text.substr(at + 1, end - at - 1);
    at = end;
    if (tag.front() == '?') continue;
    if (tag.find('<') != std::string::npos) return testing::AssertionFailure() << "< in " << tag;
    if (std::count(tag.begin(), tag.end(), '"') % 2 != 0) {
      return testing::AssertionFailure() << "quotes in " << tag;
    }
    ++elements;
    const std::string name = tag.substr(0, tag.find_first_of(" />", 1));
    if (tag.front() == '/') {
      if (open.empty() || "/" + open.back() != tag) {
        return testing::AssertionFailure() << "closed out of order: " << tag;
      }
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(name);
    }
  }
  for (size_t at = text.find('&'); at != std::string::npos; at = text.find('&', at + 1)) {
    const std::string entity = text.substr(at, text.find(';', at) - at + 1);
    if (entity != "&amp;" && entity != "&lt;" && entity != "&gt;" && entity != "&quot;" &&
        entity != "&apos;") {
      return testing::AssertionFailure() << "entity " << entity;
    }
  }
  if (!open.empty()) return testing::AssertionFailure() << "not closed: " << open.back();
  if (elements < 10) return testing::AssertionFailure() << "only " << elements << " tags";
  return testing::AssertionSuccess();
}

}  // namespace polyest::internal
