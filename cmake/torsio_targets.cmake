# The settings of all targets of this repository; users of the installed library inherit only C++20.
add_library(torsio_build_settings INTERFACE)
target_compile_options(torsio_build_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wdouble-promotion -ffp-contract=off
  $<$<BOOL:${TORSIO_WARNINGS_AS_ERRORS}>:-Werror>)
if(TORSIO_SANITIZE)
  target_compile_options(torsio_build_settings INTERFACE -fsanitize=${TORSIO_SANITIZE} -fno-omit-frame-pointer
    -fno-sanitize-recover=all
    # g++ warns of uninitialised reads in the instrumented <regex>, which the normal one does not have.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
    $<$<CXX_COMPILER_ID:Clang>:-fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/cmake/sanitizer_ignored.txt>)
  target_link_options(torsio_build_settings INTERFACE -fsanitize=${TORSIO_SANITIZE})
endif()
if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  # Kernels store vectors in arrays and structures, which is not possible for vectors of unknown length (SVE): machines
  # with SVE use NEON.
  target_compile_definitions(torsio_build_settings INTERFACE
    "HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128|HWY_RVV)")
endif()

# torsio_precompile(<target> <headers>...), or with REUSE_FROM <target> instead of headers
function(torsio_precompile target)
  if(NOT TORSIO_PRECOMPILE_HEADERS)
    return()
  endif()
  if(ARGV1 STREQUAL REUSE_FROM)
    target_precompile_headers(${target} ${ARGN})
  else()
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
  # g++ 12 forgets with them where the standard library suppresses these warnings.
  target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-stringop-overflow -Wno-restrict)
endfunction()

# torsio_folder(<target> <folder> HEADERS a.hpp ... SOURCES a.cpp ...): one folder of one library.
# Headers are named relative to include/torsio/<folder>, sources relative to src/<folder>.
function(torsio_folder target folder)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "HEADERS;SOURCES")
  list(TRANSFORM arg_HEADERS PREPEND ${PROJECT_SOURCE_DIR}/include/torsio/${folder}/)
  list(TRANSFORM arg_SOURCES PREPEND ${PROJECT_SOURCE_DIR}/src/${folder}/)
  target_sources(${target}
    PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/include FILES ${arg_HEADERS}
    PRIVATE ${arg_SOURCES})
endfunction()

# torsio_library(<name>): the library torsio_<name>, known as torsio::<name>.
function(torsio_library name)
  add_library(torsio_${name} STATIC)
  add_library(torsio::${name} ALIAS torsio_${name})
  target_compile_features(torsio_${name} PUBLIC cxx_std_20)
  set_target_properties(torsio_${name} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON
    CXX_EXTENSIONS OFF VERIFY_INTERFACE_HEADER_SETS ON)  # each public header compiles alone
  target_include_directories(torsio_${name} PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(torsio_${name} PRIVATE $<BUILD_INTERFACE:torsio_build_settings>)
endfunction()
