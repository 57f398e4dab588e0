# Writes the files of a folder into a C++ source: cmake -DFOLDER=… -DOUTPUT=… -P embedded_files.cmake
cmake_policy(VERSION 3.25)
file(GLOB_RECURSE names LIST_DIRECTORIES false RELATIVE ${FOLDER} ${FOLDER}/*)
list(SORT names)
set(arrays "")
set(entries "")
set(count 0)
foreach(name IN LISTS names)
  string(REGEX MATCH "[^.]*$" ending ${name})
  set(type_html "text/html; charset=utf-8")
  set(type_js "text/javascript; charset=utf-8")
  set(type_css "text/css; charset=utf-8")
  set(type_svg "image/svg+xml")
  set(type_png "image/png")
  set(type_ico "image/x-icon")
  set(type_woff2 "font/woff2")
  set(type_json "application/json")
  set(type_txt "text/plain; charset=utf-8")
  if(NOT DEFINED type_${ending})
    message(FATAL_ERROR "${FOLDER}/${name}: the daemon has no content type for .${ending}")
  endif()
  file(READ ${FOLDER}/${name} hex HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
  string(APPEND arrays "constexpr unsigned char kFile${count}[] = {${bytes}0};\n")
  string(APPEND entries
    "    {\"/${name}\", \"${type_${ending}}\", Bytes(kFile${count})},\n")
  math(EXPR count "${count} + 1")
endforeach()
if(count GREATER 0)
  set(body "  static const WebFile files[] = {\n${entries}  };\n  return files;\n")
else()
  set(body "  return {};\n")
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT [==[
// Made by server/web/embedded_files.cmake.
#include "server/web/web_page.h"

namespace polyest::internal {
namespace {

// Leaves out the zero that ends each file, because an array cannot be empty.
template <size_t Size>
[[maybe_unused]] std::string_view Bytes(const unsigned char (&bytes)[Size]) {
  return {reinterpret_cast<const char*>(bytes), Size - 1};
}

@arrays@
}  // namespace

std::span<const WebFile> EmbeddedFiles() {
@body@}

}  // namespace polyest::internal
]==] @ONLY)
