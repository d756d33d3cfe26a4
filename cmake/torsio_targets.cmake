# The settings of all targets of this repository; users of the installed library inherit only C++20.
add_library(torsio_build_settings INTERFACE)
target_compile_options(torsio_build_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion
  # In a unity build Clang also reports names that are the same as one of another source.
  $<$<NOT:$<AND:$<CXX_COMPILER_ID:Clang>,$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>>:-Wshadow>
  # Clang also reports where a float is only stored in a double.
  $<$<NOT:$<CXX_COMPILER_ID:Clang>>:-Wdouble-promotion> -ffp-contract=off
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

# torsio_folder(<target> <folder> HEADERS a.hpp ... SOURCES a.cpp ... [APART b.cpp ...]): one folder of one library.
# Headers are named relative to include/torsio/<folder>, sources relative to src/<folder>. In a unity build the SOURCES
# are compiled together, those that are APART (measured kernels) each on its own.
function(torsio_folder target folder)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "HEADERS;SOURCES;APART")
  list(TRANSFORM arg_HEADERS PREPEND ${PROJECT_SOURCE_DIR}/include/torsio/${folder}/)
  list(TRANSFORM arg_SOURCES PREPEND ${PROJECT_SOURCE_DIR}/src/${folder}/)
  list(TRANSFORM arg_APART PREPEND ${PROJECT_SOURCE_DIR}/src/${folder}/)
  target_sources(${target}
    PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/include FILES ${arg_HEADERS}
    PRIVATE ${arg_SOURCES} ${arg_APART})
  torsio_unity_group(${target} ${folder} ${arg_SOURCES})
endfunction()

# torsio_unity_group(<target> <name> <sources>...): these are compiled together in units of about twelve, if the target
# has unity builds.
function(torsio_unity_group target name)
  string(MAKE_C_IDENTIFIER ${name} name)
  list(LENGTH ARGN count)
  math(EXPR units "(${count} + 11) / 12")
  set(index 0)
  foreach(source ${ARGN})
    math(EXPR unit "${index} * ${units} / ${count}")
    set_source_files_properties(${source} TARGET_DIRECTORY ${target} PROPERTIES UNITY_GROUP ${name}_${unit})
    math(EXPR index "${index} + 1")
  endforeach()
endfunction()

# torsio_unity_build(<target>): for a target without measured sources but those that are APART.
function(torsio_unity_build target)
  if(NOT TORSIO_UNITY_BUILD)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  # In a unit each source is an included file, whose anonymous namespace g++ takes for that of a header.
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
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
  if(EXISTS ${PROJECT_SOURCE_DIR}/include/torsio/${name}.hpp)  # where a user of the library starts
    target_sources(torsio_${name} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/include
      FILES ${PROJECT_SOURCE_DIR}/include/torsio/${name}.hpp)
  endif()
endfunction()

# torsio_compile_quickly(<target>...): for code without long loops over numbers, of which a Release build optimises only
# what costs no compile time.
function(torsio_compile_quickly)
  foreach(target ${ARGN})
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  endforeach()
endfunction()

# What half of the sources include, and more than a quarter of the time to compile them is spent on.
set(torsio_common_headers <fmt/format.h> <algorithm> <array> <cmath> <filesystem> <functional> <map> <memory> <numeric>
  <optional> <set> <span> <string> <string_view> <utility> <variant> <vector>)
