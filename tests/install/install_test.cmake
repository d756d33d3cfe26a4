# cmake -DBUILD=<build tree> -DSOURCE=<tests/install/stranger> -DWORK=<scratch> -P install_test.cmake
# Installs torsio into a scratch prefix, builds a stranger's project against it and runs that.
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "failed (${code}): ${ARGN}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/prefix)
run(${CMAKE_COMMAND} --build ${WORK}/build)
set(torsio ${WORK}/prefix/bin/torsio)
run(${torsio} simulate dfki-50 sweep --duration 30s -o ${WORK}/sweep.csv)
run(${torsio} fit ${WORK}/sweep.csv --model linear -o ${WORK}/joint.safetensors)
run(${WORK}/build/stranger ${WORK}/joint.safetensors)
if(NOT output MATCHES "torsio [0-9.]+: -?[0-9.]+ Nm")
  message(FATAL_ERROR "the stranger's program printed: ${output}")
endif()
