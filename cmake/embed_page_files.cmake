# cmake -DSCRIPT=report.js -DSTYLE=report.css -DOUTPUT=page_files.cpp -P embed_page_files.cmake
# Writes the bundle of web/ as C++ source. A byte array: compilers limit the length of string literals.
cmake_minimum_required(VERSION 3.25)

function(bytes_of file result)
  file(READ ${file} hex HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
  string(REGEX REPLACE "((0x..,){24})" "\\1\n" bytes "${bytes}")
  set(${result} "${bytes}" PARENT_SCOPE)
endfunction()

# </script> in the bundle would end the element that contains it.
file(READ ${SCRIPT} script)
if(script MATCHES "</script")
  message(FATAL_ERROR "${SCRIPT} contains </script: an HTML page cannot contain it")
endif()

bytes_of(${SCRIPT} script_bytes)
bytes_of(${STYLE} style_bytes)
file(WRITE ${OUTPUT} "#include \"report/html/page_files.hpp\"

namespace torsio {
namespace {
constexpr unsigned char kScript[] = {${script_bytes}};
constexpr unsigned char kStyle[] = {${style_bytes}};

template <class Bytes>
std::string_view text_of(const Bytes& bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes), sizeof(bytes)};
}
}  // namespace

std::string_view page_script() noexcept { return text_of(kScript); }
std::string_view page_style() noexcept { return text_of(kStyle); }

}  // namespace torsio
")
