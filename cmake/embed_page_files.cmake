# cmake -DFILES=page_script=report.js,page_style=report.css -DHEADER=report/html/page_files.hpp -DOUTPUT=page_files.cpp
#   -P embed_page_files.cmake
# Writes files of the bundle of web/ as C++ source, a function for each. A byte array: compilers limit the length of string
# literals.
cmake_minimum_required(VERSION 3.25)

string(REPLACE "," ";" files "${FILES}")
set(arrays)
set(functions)
foreach(each IN LISTS files)
  string(REGEX MATCH "^([a-z_]+)=(.*)$" parts "${each}")
  set(name ${CMAKE_MATCH_1})
  set(file ${CMAKE_MATCH_2})
  # </script> in the bundle would end the element that contains it.
  if(file MATCHES "\\.js$")
    file(READ ${file} script)
    if(script MATCHES "</script")
      message(FATAL_ERROR "${file} contains </script: an HTML page cannot contain it")
    endif()
  endif()
  file(READ ${file} hex HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
  string(REGEX REPLACE "((0x..,){24})" "\\1\n" bytes "${bytes}")
  string(APPEND arrays "constexpr unsigned char k_${name}[] = {${bytes}};\n")
  string(APPEND functions "std::string_view ${name}() noexcept { return text_of(k_${name}); }\n")
endforeach()
file(WRITE ${OUTPUT} "#include \"${HEADER}\"

namespace torsio {
namespace {
${arrays}
template <class Bytes>
std::string_view text_of(const Bytes& bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes), sizeof(bytes)};
}
}  // namespace

${functions}
}  // namespace torsio
")
