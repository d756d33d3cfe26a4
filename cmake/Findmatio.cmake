# Finds matio.h and the name that libmatio is loaded by, TORSIO_MATIO_SONAME; matio::matio is for what links it.
# Debian's libmatio-dev has no CMake configuration of its own.
find_path(MATIO_INCLUDE_DIR matio.h)
find_library(MATIO_LIBRARY matio)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(matio REQUIRED_VARS MATIO_LIBRARY MATIO_INCLUDE_DIR)
if(matio_FOUND AND NOT TARGET matio::matio)
  add_library(matio::matio UNKNOWN IMPORTED)
  set_target_properties(matio::matio PROPERTIES IMPORTED_LOCATION ${MATIO_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${MATIO_INCLUDE_DIR})
endif()
get_filename_component(matio_file "${MATIO_LIBRARY}" REALPATH)
string(REGEX MATCH "libmatio[.]so[.][0-9]+" TORSIO_MATIO_SONAME "${matio_file}")
mark_as_advanced(MATIO_INCLUDE_DIR MATIO_LIBRARY)
