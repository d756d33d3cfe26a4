# cmake -DSOURCE=<tests/install/partial> -DWORK=<scratch> -P partial_test.cmake
# Of a build in which the Python module is missing, the program can be installed; all of it cannot, and nothing is.
cmake_minimum_required(VERSION 3.25)

function(install expected_code)
  execute_process(COMMAND ${CMAKE_COMMAND} --install ${WORK}/build --prefix ${WORK}/prefix ${ARGN}
    RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL expected_code)
    message(FATAL_ERROR "--install ${ARGN} ended with ${code}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} -G Ninja -S ${SOURCE} -B ${WORK}/build OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
foreach(part torsio_runtime torsio_coupling torsio_export torsio_fleet torsio_program)
  file(WRITE ${WORK}/build/built/${part} "")
endforeach()

install(1)
if(NOT output MATCHES "torsio_python is missing" OR NOT output MATCHES "--component program")
  message(FATAL_ERROR "the message states neither what is missing nor what to do:\n${output}")
endif()
if(EXISTS ${WORK}/prefix)
  message(FATAL_ERROR "a part was installed although another one is missing")
endif()
install(0 --component program)
if(NOT EXISTS ${WORK}/prefix/bin/torsio_program OR EXISTS ${WORK}/prefix/python)
  message(FATAL_ERROR "--component program must install the program alone")
endif()
file(WRITE ${WORK}/build/built/torsio_python "")
install(0)
