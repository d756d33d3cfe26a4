# The first rule of an installation of everything. Without it a part that was not built ends the installation in its
# midst, with nothing but the path of a library.
set(torsio_parts torsio_runtime)
if(TORSIO_BUILD_LAB)
  list(APPEND torsio_parts torsio_coupling torsio_export torsio_fleet torsio_program)
endif()
if(TORSIO_BUILD_C)
  list(APPEND torsio_parts torsio_c)
endif()
if(TORSIO_BUILD_PYTHON)
  list(APPEND torsio_parts torsio_python)
endif()
list(TRANSFORM torsio_parts REPLACE "(.+)" "\"$<TARGET_FILE:\\1>\"")
list(JOIN torsio_parts " " torsio_parts)
install(CODE "
if(NOT CMAKE_INSTALL_COMPONENT)
  foreach(file ${torsio_parts})
    if(NOT EXISTS \"\${file}\")
      message(FATAL_ERROR \"not everything is built:\n  \${file} is missing\nBuild it, or install one part:\n\"
        \"  cmake --build ${PROJECT_BINARY_DIR}\n\"
        \"  cmake --install ${PROJECT_BINARY_DIR} --component program    (or python, or runtime)\")
    endif()
  endforeach()
endif()" COMPONENT development)
